"""Every bearing of the zoo under both ends of a finite-element shaft, from a rig file: simulated, then identified."""

import numpy as np
import pytest
import xarray as xr
import yaml
from machines import disc, shaft

from jobs.bearing_figures import bearing_coefficients, plot_bearing_coefficients
from rotorstudy import build_model, eigenvalues, harmonic_response, make_term, registry, stability_threshold
from rotorstudy.commands.line import main
from rotorstudy.response.statics import static_deflection

SHAFT = shaft(1.0, 4, disc(3, 80.0, 0.9, 0.5), outer_diameter_m=0.06)
UNBALANCE = {"kind": "unbalance", "node": 3, "mass_kg": 80.0, "eccentricity_m": 1e-5}
BEARINGS = registry().plugins["bearing"].values()


def rig(plugin, **more):
    """A rig file's contents: the plugin's example at both ends, every amplitude at its typical size."""
    structure = build_model({"rotor": SHAFT}).structure
    item = {"kind": plugin.name, **plugin.example, **more}
    parameters = make_term("bearing", {**item, "node": 1}, structure, structure.nodes).parameters
    values = {parameter.key: parameter.typical for parameter in parameters}
    ends = [{**item, "node": node, "label": label, **values} for node, label in ((1, "left"), (5, "right"))]
    return {"rotor": SHAFT, "bearings": ends, "effects": [UNBALANCE], "sensors": [1, 3, 5]}


@pytest.mark.parametrize("plugin", BEARINGS, ids=lambda p: p.name)
def test_simulated_and_identified_by_name_from_a_rig_file(plugin, tmp_path):
    given = rig(plugin)
    air = {"kind": "external_damping", "node": 3, "external_damping_N_s_per_m": 2000.0}  # some examples drive a whirl
    given["effects"] = [*given["effects"], air]
    file, records, estimates = tmp_path / "rig.yaml", tmp_path / "records.nc", tmp_path / "estimates.nc"
    file.write_text(yaml.safe_dump(given))
    model = build_model(given)
    names = [u.name for u in model.rotor_unknowns if u.carries]
    speeds = ["--speeds", "60", "95", "130", "180"]
    assert main(["simulate", str(file), *speeds, "--noise", "0.1", "--seed", "1", "--out", str(records)]) == 0
    unknowns = ["--unknowns", *names]
    assert main(["identify", str(records), "--rig", str(file), *unknowns, "--out", str(estimates)]) == 0
    with xr.open_dataset(estimates) as found:
        true = model.theta[model.position(list(found.parameter.values))]
        # five standard deviations: one in a million for a right interval
        assert (np.abs(found.estimate - true) < 5 * found.standard_deviation).all()
        assert (found.standard_deviation < 0.05 * np.abs(true)).all()


def weight(model):
    return model.structure.static_load.sum()


def journals(viscosity=0.05):
    """A shaft whose weight its two journals share."""
    plugin = registry().get("bearing", "short_journal")
    share = weight(build_model({"rotor": SHAFT})) / 2
    return build_model(rig(plugin, load_N=float(share), viscosity_Pa_s=viscosity))


def test_journals_carry_the_weight_in_equal_shares_and_bend_the_shaft_as_any_bearing_does():
    model = journals()
    deflection = static_deflection(model, [88.0, 300.0], model.theta).value
    force = deflection @ model.structure.stiffness.T - model.structure.static_load
    ends = [model.structure.index(1), model.structure.index(5)]
    assert np.abs(force[:, ends] + weight(model) / 2).max() < 1e-8 * weight(model)
    bent = deflection[:, model.structure.index(3)] - deflection[:, ends].mean(axis=1)
    assert bent[0] == pytest.approx(bent[1], rel=1e-8)
    assert np.abs(deflection[0] - deflection[1]).max() > 1e-6


def test_unbalance_on_journals_goes_backward_too_and_oil_whip_starts_near_twice_the_first_mode():
    model = journals()
    forward, backward = np.abs(harmonic_response(model, [100.0], [1, -1])[0, :, model.structure.index(3)])
    assert forward > backward > 1e-3 * forward
    threshold = stability_threshold(model, 2000.0)
    values = eigenvalues(model, [threshold])[0]
    whirl = abs(values[np.argmax(values.real)].imag)
    assert 0.45 < whirl / threshold < 0.52
    for factor, grows in ((0.99, False), (1.01, True)):
        assert bool(eigenvalues(model, [factor * threshold]).real.max() > 0) is grows


def test_every_bearing_is_compared_and_a_speed_it_refuses_is_left_out():
    data = bearing_coefficients(BEARINGS, np.array([50 * np.pi, 900.0, 1200.0]))
    assert list(data.bearing.values) == sorted(plugin.name for plugin in BEARINGS)
    journal = data.sel(bearing="short_journal").isel(speed=0)  # the textbook's example, see test_film_bearings
    assert journal.stiffness.values / 1e6 == pytest.approx([8.815, 25.06, -16.39, 12.81], rel=4e-4)
    assert journal.damping.values / 1e3 == pytest.approx([294.9, 81.92, 81.92, 232.9], rel=3e-4)
    table = data.stiffness.sel(bearing="speed_tabulated", direction="xx").values  # ends at 1000 rad/s
    assert table[:2] == pytest.approx(np.interp([50 * np.pi, 900.0], [0, 1000], [3e5, 2e5])) and np.isnan(table[2])
    assert data.stiffness.attrs["units"] == "N/m" and data.damping.attrs["units"] == "N s/m"
    picture = plot_bearing_coefficients(data)
    assert len(picture.axes) == 2 * len(BEARINGS)
    assert all("(" in panel.get_ylabel() for panel in picture.axes)
