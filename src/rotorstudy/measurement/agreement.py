"""What the records of one measurement have in common: probes, sensors and the zero of displacements."""

from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError


def common_nodes(facts):
    """Nodes of all records; RotorstudyError if they differ."""
    first = set(facts[0].nodes)
    for one in facts:
        if set(one.nodes) != first:
            raise RotorstudyError(
                f"{one.where} has nodes {sorted(one.nodes)}, {facts[0].where} has {sorted(first)}; all "
                "records of one measurement need the same probes"
            )
    return first


def common_directions(found, sensors):
    """(sensor,) rad, direction of the only probe of each node, NaN for orbits; RotorstudyError if records differ."""
    usable = [one for one in found if one.harmonics is not None]
    for one in usable:
        if one.directions != usable[0].directions:
            raise RotorstudyError(
                f"{one.facts.where} has {_single(one.directions)}, {usable[0].facts.where} has "
                f"{_single(usable[0].directions)}; all records of one measurement need the same probes "
                "(is a row of a table missing?)"
            )
    return np.array([usable[0].directions.get(node, np.nan) if usable else np.nan for node in sensors])


def _single(directions):
    """Where records have only one probe, in words. directions : {node: rad}"""
    return f"a single probe at node {', '.join(map(str, sorted(directions)))}" if directions else "no single probe"


def wanted_sensors(rig, measured):
    """Sensors of the rig: those in the rig file, which must have been measured, or all measured nodes."""
    wanted = rig.given.get("sensors") or sorted(measured)
    for node in wanted:
        if node not in measured:
            raise RotorstudyError(
                f"{rig.path}: 'sensors' has node {node}, but the records have nodes {sorted(measured)}; leave it out"
            )
    return wanted


def measured_model(rig, sensors, stated, directions):
    """The Model of a rig file with the measured nodes as sensors.

    stated : the Conventions of each record;  directions : (sensor,) rad of the only probes, NaN for orbits
    """
    zeros = {one.displacement_zero for one in stated}
    if len(zeros) > 1:
        raise RotorstudyError(
            "displacements of some records count from the unloaded line, of others from the shaft at "
            "rest, as in simulated records; read them separately"
        )
    model = rig.measured_at(sensors, stated[0].reading(sensors, directions))
    return replace(model, from_unloaded_line=zeros == {"unloaded_line"})
