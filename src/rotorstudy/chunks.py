"""Long sweeps in chunks, each a job of its own: the numbers do not depend on how many."""

import numpy as np


def chunk_of(items, chunk, chunks):
    """The items of one of several chunks of almost equal length, in order; chunk : 0 to chunks - 1."""
    return [items[i] for i in np.array_split(np.arange(len(items)), chunks)[chunk].tolist()]


def gathered(parts, dimension):
    """One Dataset from those of all chunks, in order; variables without the dimension are those of the first."""
    import xarray as xr

    same = {"compat": "override", "combine_attrs": "override", "join": "exact"}
    return xr.concat(parts, dimension, data_vars="minimal", coords="minimal", **same)
