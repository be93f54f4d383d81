"""Wrong conventions corrected exactly for any directions; what probes show is from the picture, not the package."""

import numpy as np
import pytest
from machines import readings

from rotorstudy import build_model, make_term
from rotorstudy.diagnosis.verdict.measuring_chain import hypotheses
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.measurement.table_spectra import read_table
from rotorstudy.measurement.tables import open_table
from rotorstudy.model.entries import apply_entries

HARMONICS = np.array([0, 1, -1, 2, -2])
ORDERS = np.array([0, 1, 2])
RIG = {"rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}}
DIRECTIONS = [(0.0, (0.0, 90.0), 0.0), (30.0, (75.0, -15.0), 20.0), (-90.0, (45.0, 135.0), 110.0)]
DIRECTIONS += [(200.0, (10.0, 85.0), -70.0)]


def stated(gravity, angles, mark, rotation):
    """Conventions with two probes at node 1."""
    probes = [{"channel": name, "node": 1, "angle_deg": angle} for name, angle in zip("ab", angles, strict=True)]
    given = {"keyphasor": {"sensor_angle_deg": mark, "mark_angle_deg": 5.0}, "harmonics": HARMONICS.tolist()}
    return Conventions(rotation=rotation, gravity_angle_deg=gravity, probes=probes, **given)


def spectrum_of(phasors, angles, conventions):
    """The Spectrum of readings Re(P e^{jkwt}), phasors P (probe, order), t from the passing of the phase mark.

    In the plane of the user x points along gravity after a turn; y is mirrored if the shaft turns against the angles.
    """
    sense = 1 if conventions.rotation == "with_angles" else -1
    down = np.deg2rad(conventions.gravity_angle_deg)
    a = sense * (np.deg2rad(angles) - down)
    x, y = np.linalg.inv(np.column_stack([np.cos(a), np.sin(a)])) @ phasors
    forward, backward = (x + 1j * y) / 2, (x - 1j * y).conj() / 2
    key = conventions.keyphasor
    line = sense * (np.deg2rad(key.sensor_angle_deg) - down - np.deg2rad(key.mark_angle_deg))
    sides = [2 * forward[0] if n == 0 else (forward if n > 0 else backward)[abs(n)] for n in HARMONICS]
    found = sides * np.exp(-1j * HARMONICS * line)
    return readings(found[None, :, None], [100.0], HARMONICS, (1,), 1.0)


def corrected(wrong, conventions, name):
    """A spectrum corrected by the hypothesis of a name."""
    model = build_model(RIG, reading=conventions.reading([1]))
    (one,) = (h for h in hypotheses(wrong, model) if name in h.name)
    return one.corrected(wrong)[0].amplitude


def drawn(seed=1):
    """Phasors (probe, order), that of the mean real."""
    draws = np.random.default_rng(seed).normal(size=(2, 2, len(ORDERS)))
    return draws[0] + 1j * draws[1] * (ORDERS > 0)


WRONG = {
    "phases of the probes are lags": lambda shown: shown.conj(),
    "two probes of all nodes are swapped": lambda shown: shown[::-1],
    "of probe 'b' at node 1 are 0.5 times": lambda shown: shown * np.array([[1.0], [0.5]]),
}


@pytest.mark.parametrize("rotation", ["with_angles", "against_angles"])
@pytest.mark.parametrize(
    ("name", "directions"),
    # swapped probes are taken for a pair at right angles
    [(name, one) for name in WRONG for one in DIRECTIONS if "swapped" not in name or np.ptp(one[1]) == 90],
)
def test_what_the_probes_show(name, directions, rotation):
    gravity, angles, mark = directions
    conventions, shown = stated(gravity, angles, mark, rotation), drawn()
    true, wrong = (spectrum_of(one, angles, conventions) for one in (shown, WRONG[name](shown)))
    assert corrected(wrong, conventions, name) == pytest.approx(true.amplitude, abs=1e-12)
    assert np.abs(wrong.amplitude - true.amplitude).max() > 0.1  # negative control


@pytest.mark.parametrize("directions", DIRECTIONS)
def test_the_sense_of_rotation(directions):
    gravity, angles, mark = directions
    read, right = (stated(gravity, angles, mark, sense) for sense in ("with_angles", "against_angles"))
    wrong, true = (spectrum_of(drawn(), angles, one) for one in (read, right))
    assert corrected(wrong, read, "other sense") == pytest.approx(true.amplitude, abs=1e-12)


@pytest.mark.parametrize("rotation", ["with_angles", "against_angles"])
@pytest.mark.parametrize("directions", DIRECTIONS)
def test_a_table_of_lags(directions, rotation, tmp_path):
    """The table is in the plane of the user, so that its harmonics are conjugated there and then turned."""
    generator, table = np.random.default_rng(2), tmp_path / "table.csv"
    rows = [f"100.0,1,{n},{generator.uniform(1, 4)}e-6,{generator.uniform(-3, 3)}" for n in HARMONICS]
    table.write_text("\n".join(["speed_rad_per_s,node,harmonic,amplitude_m,phase_rad", *rows]))
    conventions, read = stated(*directions, rotation), {}
    for phase in ("lead", "lag"):
        given = conventions.model_copy(update={"table_phase": phase})
        (of_speed,), _ = read_table(open_table(table, given.csv), given, (1,))
        read[phase] = of_speed.nodes[1].amplitude[None, :, None]
    wrong = readings(read["lead"], [100.0], HARMONICS, (1,), 1.0)
    found = corrected(wrong, conventions, "phases of the table are lags")
    assert found == pytest.approx(read["lag"], abs=1e-18)
    assert np.abs(found - read["lead"]).max() > 1e-7


EFFECTS = {  # what probes x and y show instead of their phasors (order,)
    "reversed_probe x": ({"kind": "reversed_probe", "probe": "x"}, lambda x, y: (-x, y)),
    "reversed_probe y": ({"kind": "reversed_probe", "probe": "y"}, lambda x, y: (x, -y)),
    "swapped_probes": ({"kind": "swapped_probes"}, lambda x, y: (y, x)),
    "gain_error": ({"kind": "probe_gain"}, lambda x, y: (2 * x, 2 * y)),
    "gain_mismatch": ({"kind": "probe_gain"}, lambda x, y: (2 * x, 0 * y)),
    "probe_rotation": ({"kind": "probe_angle"}, lambda x, y: (x + y, y - x)),
    "probe_skew": ({"kind": "probe_angle"}, lambda x, y: (x, y - x)),
}


@pytest.mark.parametrize("rotation", ["with_angles", "against_angles"])
@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("directions", [(0.0, (0.0, 90.0)), (30.0, (75.0, -15.0)), (180.0, (-45.0, 45.0))])
def test_effects_of_probes_act_along_them(name, directions, rotation):
    """A unit of each effect, which is linear; x is the probe from which the other is 90 degrees ahead."""
    (gravity, angles), (item, show) = directions, EFFECTS[name]
    conventions, shown = stated(gravity, angles, gravity + 5.0, rotation), drawn()  # the reference line along x
    ahead = (angles[1] - angles[0]) * conventions.sense > 0
    changed = np.array(show(*shown) if ahead else show(*shown[::-1])[::-1])
    true, wrong = (spectrum_of(one, angles, conventions).amplitude for one in (shown, changed))
    structure = build_model(RIG, reading=conventions.reading([1])).structure
    term = make_term("effect", {**item, "node": 1}, structure, (1,))
    (parameter,) = (p for p in term.parameters if name.startswith(p.name) or p.name.startswith(item["kind"]))
    column = apply_entries(parameter.entries, true, np.array([100.0]), HARMONICS)
    assert column == pytest.approx(wrong - true, abs=1e-12)
