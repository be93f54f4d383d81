"""Check of a rig file: is it valid, what follows from it, and what is odd about it."""

from functools import partial
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.errors import CannotAct, RotorstudyError, check_known
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.findings import Finding, errors_among, worst_first
from rotorstudy.measurement.plausibility import check_probes
from rotorstudy.model.rig import read_rig
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.whirl import damped_modes, time_invariant, without_rotation
from rotorstudy.studies.plausibility import implausible_numbers, odd_discs, odd_films, odd_materials, stated_loads, told
from rotorstudy.studies.rotor_analysis import MODES, analyse_rotor
from rotorstudy.studies.unbalance_response import with_unbalance
from rotorstudy.units import percent, quantity

TRIED = np.geomspace(0.1, 1e5, 121)  # rad/s, at which it is tried whether the bearings are defined
HALVINGS = 30  # of the interval about an end of that range
BLIND = 0.05  # of the largest motion in a mode: a probe that sees less is at a nodal point of it
UNDAMPED = 1e-4  # damping ratio below which a resonance is sharper than in any machine
NO_SIZES = ("measurement", "diagnosis", "prior")  # sections
FILM_ORBIT = 1 / 3  # semi-major axis over the clearance of a film, up to which it is nearly linear
UNCERTAIN = 2.0  # standard deviation of a parameter relative to its value, as which a percentage is no share
SAG = 1e-3  # m, static deflection of a shaft in its bearings beyond which they are too soft
_speed = partial(quantity, unit="rad/s", digits=4)


class RigCheck(NamedTuple):
    """What is known of a rig; no analysis if a value is missing, `valid` are the speeds of its bearings, rad/s."""

    findings: list
    analysis: object = None
    valid: tuple | None = None
    model: object = None

    @property
    def errors(self):
        """Findings that are errors."""
        return errors_among(self.findings)


def check_rig(path):
    """Check a rig file."""
    rig = None
    try:
        rig = read_rig(path)
        model = rig.model
    except RotorstudyError as error:
        said = str(error).removeprefix(str(path)).lstrip(":, ")
        return RigCheck([Finding("error", "not valid", str(path), said), *(_implausible(rig) if rig else ())])
    probes, of_probes = _probes(rig, model)
    findings = [*_diagnosis(rig, model), *of_probes, *_implausible(rig), *odd_materials(rig.given["rotor"])]
    bearings = [item for item in rig.given.get("bearings") or [] if isinstance(item, dict)]
    loads = _loads(model.structure)
    findings += [*odd_discs(model.structure), *stated_loads(bearings, loads), *odd_films(bearings, loads)]
    valid, analysis = speed_range(model), None
    if valid is None:
        findings.append(told("speeds", path))
    if missing := model.unstated:
        findings.append(told("unknown", path, names=", ".join(missing)))
    elif valid:
        try:
            analysis = _analysed(model, valid)
        except RotorstudyError as error:
            findings.append(Finding("error", "rotor", str(path), str(error)))
        else:
            findings += [*_wide_orbits(model, analysis), *_of_analysis(analysis, str(path))]
            stated = {probe.node for probe in probes} & set(model.structure.nodes)
            findings += _probes_at_nodes(model, analysis, sorted(stated) or model.sensors)
    return RigCheck(worst_first(findings), analysis, valid, model)


def speed_range(model):
    """Lowest and highest speed, of 0.1 to 1e5 rad/s, at which all that acts on the rotor is defined, or None."""
    entries = [e for _, u in model.acting for e in u.entries if e.gain is not None]

    def defined(speed):
        try:
            for entry in entries:
                entry.gain_at(speed, 1)
        except RotorstudyError:
            return False
        return True

    good = np.flatnonzero([defined(w) for w in TRIED])
    if not len(good):
        return None

    def end(inside, outside):
        inside, outside = TRIED[[inside, np.clip(outside, 0, len(TRIED) - 1)]].tolist()
        for _ in range(HALVINGS if inside != outside else 0):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if defined(middle) else (inside, middle)
        return inside

    return end(good[0], good[0] - 1), end(good[-1], good[-1] + 1)


def _analysed(model, valid):
    """The RotorAnalysis up to its usual highest speed, or up to where the bearings are defined."""
    low = None if valid[0] <= TRIED[0] else valid[0]
    try:
        return analyse_rotor(model, low)
    except RotorstudyError:
        if valid[1] >= TRIED[-1]:
            raise
    return analyse_rotor(model, low, valid[1])


def _implausible(rig):
    """Findings on the numbers of the machine; those of the other sections are shares, angles and rates."""
    return implausible_numbers({key: given for key, given in rig.given.items() if key not in NO_SIZES})


def _diagnosis(rig, model):
    """Findings on the section `diagnosis:`."""
    path = str(rig.path)
    try:
        settings = read_settings(rig.given, path)
        check_names(settings, model, f"{path}, diagnosis")
        for name, share in settings.uncertainty.items():
            if share > UNCERTAIN:
                yield told("uncertainty", f"{path}, diagnosis", name=name, share=share, percent=percent(share))
    except RotorstudyError as error:
        yield Finding("error", "diagnosis", path, str(error))


def _probes(rig, model):
    """The probes of the section `measurement:`, and findings on it."""
    path, probes = str(rig.path), []
    try:
        probes = read_conventions(rig.given, path).probes
        for probe in (probe for probe in probes if probe.node is not None):
            check_known("node", [probe.node], model.structure.measurable, f"probe '{probe.channel}'")
    except RotorstudyError as error:
        return probes, [Finding("error", "measurement", path, str(error))]
    return probes, [*check_probes(probes, path), *([] if "measurement" in rig.given else [told("measurement", path)])]


def _loads(structure):
    """{node: N} static loads of the bearings if they are rigid."""
    try:
        return {node: structure.bearing_load(node) for node in structure.bearing_nodes}
    except CannotAct:
        return {}


def _of_analysis(analysis, path):
    """Findings on deflection, damping and stability."""
    moved = analysis.data.coordinate.str.startswith("translation").values
    sag = float(np.abs(analysis.data.static_deflection.values[moved]).max())
    if sag > SAG:
        yield told("static deflection", path, sag=1e3 * sag)
    if analysis.criticals and not analysis.resonant:
        yield told("damping (too much)", path)
    for one in analysis.criticals:
        if 0 <= one.damping_ratio < UNDAMPED:
            yield told("damping", f"critical speed {_speed(one.speed)}", ratio=one.damping_ratio)
    if lifted := [f"node {load.node}" for load in analysis.loads if load.force.real < 0]:
        yield told("loads", path, nodes=", ".join(lifted))
    if analysis.threshold is not None:
        cause = max(analysis.damping, key=analysis.damping.get, default="stiffness that rotates with the shaft")
        severity = "error" if analysis.threshold <= float(analysis.data.speed[0]) * (1 + 1e-9) else None
        yield told("stability", path, severity, speed=_speed(analysis.threshold), cause=cause)


def _wide_orbits(model, analysis):
    """Findings on films in which the orbits by unbalance are too wide for linear coefficients."""
    speeds = analysis.data.response_speed.values
    unbalanced, unbalance = with_unbalance(without_rotation(model), float(analysis.data.speed[-1]))
    for bearing in model.structure.bearings:
        clearance = bearing.options.get("radial_clearance_m")
        if clearance is None:
            continue
        node = bearing.options["node"] or model.structure.default_node()
        motion = harmonic_response(unbalanced, speeds, (1, -1))[..., model.structure.index(node)]
        size = np.abs(motion).sum(axis=-1)
        wide = np.flatnonzero(size > FILM_ORBIT * clearance)
        if len(wide):
            said = {"share": percent(size[wide[0]] / clearance, 2), "speed": _speed(speeds[wide[0]])}
            yield told("orbit in a film", f"bearing at node {node}", unbalance=unbalance, **said)


def _probes_at_nodes(model, analysis, nodes):
    """Findings on probes that do not see a mode at its critical speed."""
    still = time_invariant(model)
    moves = [i for i, (_, motion) in enumerate(still.structure.dofs) if motion == "translation"]
    for one in analysis.resonant:
        modes = damped_modes(still, [one.speed], MODES)
        mode = int(np.nanargmin(np.abs(modes.frequency[0] - one.speed)))
        size = np.hypot(np.abs(modes.forward[0, mode]), np.abs(modes.backward[0, mode]))
        share = size / size[moves].max()
        seen = {node: float(share[still.structure.index(node)]) for node in nodes}
        where = f"critical speed {_speed(one.speed)}"
        best = max(still.structure.nodes, key=lambda n: share[still.structure.index(n)])
        for node, part in seen.items():
            if part < BLIND:
                severity = None if max(seen.values()) < BLIND else "note"
                said = {"node": node, "share": percent(round(part, 4), 2), "best": best}
                yield told("probe at a nodal point", where, severity, **said)
