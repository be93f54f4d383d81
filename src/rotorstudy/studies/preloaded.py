"""What most jobs of the workflow need, imported once: the processes of jobs are copies of one that imported this."""

import matplotlib.pyplot
import netCDF4
import scipy.stats
import snakemake.cli  # the copies import the program that started them
import xarray

from rotorstudy.model.registry import registry

__all__ = ["matplotlib", "netCDF4", "scipy", "snakemake", "xarray"]
registry()
