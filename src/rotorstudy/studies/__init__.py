"""Stages of a study, for any rig: configuration in, xarray Dataset out. The workflow calls them, one job each."""
