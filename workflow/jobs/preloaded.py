"""What most jobs of the workflow need, imported once: the processes of jobs are copies of one that imported this."""

import matplotlib.pyplot
import netCDF4
import scipy.stats
import xarray

from rotorstudy.model.registry import registry

__all__ = ["matplotlib", "netCDF4", "scipy", "xarray"]
registry()
