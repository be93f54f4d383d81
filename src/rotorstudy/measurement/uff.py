"""The data sets 58 of a UFF file, which are signals in time or frequency responses."""

import numpy as np

from rotorstudy.errors import RotorstudyError, reading

UFF_ORDERS = {8: 0, 11: 1, 12: 2}  # code of a displacement, a velocity, an acceleration -> order of the derivative


def uff_sets(path):
    """The data sets 58 of a UFF file, and the numbers of the kinds of all."""
    try:
        import pyuff
    except ImportError:
        raise RotorstudyError(f"{path}: UFF files need the package pyuff; pip install pyuff") from None
    with reading("UFF file", path):
        opened = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in np.atleast_1d(opened.get_set_types())]
        return [opened.read_sets(i) for i, kind in enumerate(kinds) if kind == 58], kinds
