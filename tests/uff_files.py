"""Files of the Universal File Format with signals in time."""

import warnings

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
