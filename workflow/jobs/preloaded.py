"""What most jobs of the workflow need, imported once: the processes of jobs are copies of one that imported this."""

import gc

import matplotlib.pyplot
import netCDF4
import scipy.stats
import xarray

from rotorstudy.model.registry import registry

__all__ = ["matplotlib", "netCDF4", "scipy", "xarray"]
registry()
gc.freeze()  # what is loaded stays to the end: garbage collection of it took 5 % of the time of jobs
gc.set_threshold(50_000, 20, 20)
