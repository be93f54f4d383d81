"""Files of the Universal File Format: signals in time, and mobilities."""

import warnings

import numpy as np
import pyuff

PLAIN = {"func_type": 1, "rsp_dir": 1, "ref_dir": 1, "ref_node": 1, "ver_num": 0, "load_case_id": 0}
PLAIN |= {"ord_data_type": 4, "abscissa_spacing": 1, "abscissa_min": 0.0, "z_axis_value": 0.0}
PLAIN |= dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "")
PLAIN |= {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8}
PLAIN |= dict.fromkeys(("orddenom_spec_data_type", "z_axis_spec_data_type"), 0)


def signal_set(name, node, time, signal, binary=0):
    """A data set of a signal over time (time,), s."""
    measured = {"num_pts": len(time), "x": time, "abscissa_inc": time[1], "data": signal}
    return pyuff.prepare_58(id1=name, rsp_node=node, binary=binary, **measured, **PLAIN)


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
        codes = [(int(point[:-1]), 1 + "xyz".index(point[-1])) for point in (response, force)]
        data = -1j * frequency * np.array(values)
        ends = dict(
            zip(("rsp_node", "rsp_dir", "ref_node", "ref_dir"), (*codes[0], codes[1][0], -codes[1][1]), strict=True)
        )
        kind = {"func_type": 4, "abscissa_spacing": 0, "binary": 0, "ordinate_spec_data_type": 12}
        numbers = dict.fromkeys(pyuff.prepare_58(func_type=4, return_full_dict=True), 0)
        texts = {name: "NONE" for name in numbers if name.startswith("id") or name.endswith(("name", "label"))}
        one = {**numbers, **texts, "type": 58, "data": data, "x": frequency / (2 * np.pi), **kind, **ends, **labels}
        write_sets(path, one)
