"""Gap voltages of a table, and where films say that journals run."""

import numpy as np
from machines import film, shaft
from one_line_errors import refused

from rotorstudy import Spectrum, build_model
from rotorstudy.blind.machines.film import Film, running_position
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.tables import gap_positions
from rotorstudy.presentation import rotor_files
from rotorstudy.studies.centreline import centrelines, journals_moved

FILM = film(0.08, 0.03, 7e-5, 0.018)
SPEEDS = np.array([125.0, 250.0, 400.0])
RIG = {
    "rotor": shaft(0.6, 2, outer_diameter_m=0.1),
    "bearings": [FILM | {"node": node, "label": str(node)} for node in (1, 3)],
    "measurement": {
        "gravity_angle_deg": 180,
        "probes": [
            {"channel": f"B{node} {name}", "node": node, "angle_deg": angle, "gap_at_rest_V": -9.0 - node}
            for node in (1, 3) for name, angle in (("X", -45), ("Y", 45))
        ],
    },
}  # fmt: skip


def test_gap_voltages_show_where_the_journal_runs(tmp_path):
    """Of journals of the independent simulator's film; 200 mV/mil, less negative as the shaft comes nearer."""
    model = build_model(RIG)
    load = float(model.structure.static_load.real.sum()) / 2
    film = Film(0, FILM["diameter_m"], FILM["length_m"], FILM["radial_clearance_m"], FILM["viscosity_Pa_s"], load)
    rows = ["Speed (rpm),B1 X Gap (V),B1 Y Gap (V),B3 X DC Gap (V)"]
    for speed in SPEEDS:
        up = film.clearance - running_position(film, speed)[0]
        ahead = running_position(film, speed)[1]  # from the bottom, to the right of who sees it turn counterclockwise
        volts = [-10 + 7874 * (up + side * ahead) / 2**0.5 for side in (1, -1)]
        rows.append(f"{speed * 30 / np.pi:.4f},{volts[0]:.4f},{volts[1]:.4f},-12")
    (tmp_path / "t.csv").write_text("\n".join(rows))
    found = gap_positions(tmp_path / "t.csv", read_conventions(RIG, "rig"))
    assert set(found) == {1}  # node 3 has one voltage only
    first, second = centrelines(model, SPEEDS, found)
    assert len(second.measured) == 0 and len(second.predicted) == 3
    assert np.abs(first.measured - first.predicted).max() < 5e-4 * film.clearance  # the voltages are rounded
    assert np.abs(first.measured - first.expected).max() < 5e-4 * film.clearance
    thinner = dict(RIG, bearings=[one | {"viscosity_Pa_s": 0.009} for one in RIG["bearings"]])
    other, _ = centrelines(build_model(thinner), SPEEDS, found)
    assert np.abs(other.measured - other.predicted).min() > 0.02 * film.clearance  # negative control
    speed, place = found[1]
    (same,) = journals_moved(model, found, {1: (speed * 1.002, place + 1e-6)})
    (moved,) = journals_moved(model, found, {1: (speed, place + 8e-6j)})
    assert same.name == "journal in place" and moved.name == "journal moved" and moved.where == "bearing 1"
    assert not list(journals_moved(model, found, {1: (speed * 1.1, place)}))  # at other speeds
    (lost,) = journals_moved(model, found, {1: (speed, place + 3 * film.clearance)})
    assert lost.name == "journal out of place" and lost.severity == "warning" and "'gap_at_rest_V'" in lost.text


def test_gaps_in_another_unit_are_refused_and_one_at_rest_that_a_probe_lacks_is_asked_for(tmp_path):
    """Without any at rest the columns are not read."""
    (tmp_path / "t.csv").write_text("Speed (rpm),B1 X Gap (mil),B1 Y Gap (mil)\n1000,40,41\n")
    refused(lambda: gap_positions(tmp_path / "t.csv", read_conventions(RIG, "rig")), "is in 'mil'; gaps are read in V")
    (tmp_path / "t.csv").write_text("Speed (rpm),B1 X Gap (V),B1 Y Gap (V)\n1000,-9,-9.1\n")
    x, y, *others = RIG["measurement"]["probes"]
    bare = [{key: value for key, value in one.items() if key != "gap_at_rest_V"} for one in (x, y)]

    def read(*probes):
        measurement = RIG["measurement"] | {"probes": [*probes, *others]}
        return gap_positions(tmp_path / "t.csv", read_conventions(RIG | {"measurement": measurement}, "rig"))

    refused(lambda: read(x, bare[1]), "column 'B1 Y Gap (V)': state 'gap_at_rest_V:' of this probe too")
    assert read(*bare) == {} and set(read(x, y)) == {1}


def test_mean_positions_are_those_of_all_tables_by_speed(monkeypatch):
    tables = {"late.csv": {1: (np.array([400.0]), np.array([4j]))}, "early.csv": {1: (SPEEDS[:2], np.array([1, 2j]))}}
    monkeypatch.setattr(rotor_files, "gap_positions", lambda path, conventions: tables[path])
    spectrum = Spectrum(np.zeros((1, 1, 1)), [1.0], [1], [1], np.zeros((1, 1, 2, 2)))
    speed, place = rotor_files.mean_positions([*tables], None, spectrum, build_model(RIG))[1]
    assert speed.tolist() == SPEEDS.tolist() and place.tolist() == [1, 2j, 4j]
