"""Files of the Universal File Format: signals in time, and mobilities."""

import warnings

import numpy as np
import pyuff

KEYS = pyuff.prepare_58(func_type=1, return_full_dict=True)
PLAIN = {key: "NONE" if key.startswith("id") or key.endswith(("name", "lab")) else 0 for key in KEYS}
PLAIN |= {"type": 58, "rsp_dir": 1, "ref_dir": 1, "ref_node": 1, "ordinate_spec_data_type": 8}
SIGNAL = {"func_type": 1, "ord_data_type": 4, "abscissa_spacing": 1, "abscissa_spec_data_type": 17}


def signal_set(name, node, time, signal, binary=0):
    """A data set of a signal over time (time,), s."""
    measured = {"num_pts": len(time), "x": time, "abscissa_inc": time[1], "data": signal}
    return {**PLAIN, **SIGNAL, "id1": name, "rsp_node": node, "binary": binary, **measured}


def write_sets(path, sets):
    """Add data sets to a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff 2.5.8 does not close the file
        pyuff.UFF(str(path)).write_sets(sets, mode="add")


def write_mobilities(path, rows, frequency, **labels):
    """Mobilities of a CSV table as accelerances in data sets 58, forces at all nodes against their axis."""
    responses = {}
    for _, response, force, real, imaginary in (row.split(",") for row in rows):
        responses.setdefault((response, force), []).append(float(real) + 1j * float(imaginary))
    for (response, force), values in responses.items():
        (node, axis), (at, along) = ((int(point[:-1]), 1 + "xyz".index(point[-1])) for point in (response, force))
        ends = {"rsp_node": node, "rsp_dir": axis, "ref_node": at, "ref_dir": -along}
        measured = {"x": frequency / (2 * np.pi), "data": -1j * frequency * np.array(values)}
        kind = {"func_type": 4, "ordinate_spec_data_type": 12}
        write_sets(path, PLAIN | kind | ends | measured | labels)
