"""Long records are read and written one speed at a time, with the numbers of all at once."""

from pathlib import Path

import numpy as np
import pytest
from one_line_errors import refused, run

from rotorstudy import RotorstudyError, read_rig, simulate_records
from rotorstudy.measurement import measurement, netcdf_files
from rotorstudy.measurement.angle_fit import PIECE, fit_each, fit_harmonics
from rotorstudy.measurement.harmonics import fit_basis
from rotorstudy.measurement.records import records_dataset
from rotorstudy.response.series import rotating_basis
from rotorstudy.store import load, save_along

RIG = str(Path(__file__).parents[2] / "examples" / "jeffcott.yaml")
HARMONICS = [0, 1, -1, 2, -2]


def signals(samples):
    generator = np.random.default_rng(1)
    angle = np.linspace(0.3, 400.0, samples)
    shown = np.exp(1j * np.outer([1, 2], angle)) + 0.1 * generator.normal(size=(2, samples))
    return shown, angle


@pytest.mark.parametrize("samples", [PIECE // 2, 3 * PIECE + 5])
def test_a_fit_in_pieces_is_that_of_the_whole(samples):
    shown, angle = signals(samples)
    whole = fit_basis(shown, rotating_basis(angle, 1.0, HARMONICS))
    for part, other in zip(fit_harmonics(shown, angle, HARMONICS), whole, strict=True):
        np.testing.assert_allclose(part, other, rtol=0, atol=1e-12)


def test_a_signal_with_missing_samples_is_fitted_by_itself():
    shown, angle = signals(2 * PIECE)
    whole = fit_each(shown, angle, HARMONICS)
    shown[0, 5:50] = np.nan
    gap, other = fit_each(shown, angle, HARMONICS)
    assert gap.residual.shape == (2 * PIECE - 45,) and np.isfinite(gap.amplitude).all()
    np.testing.assert_allclose(other.amplitude, whole[1].amplitude, atol=1e-12)
    assert abs(gap.amplitude - whole[0].amplitude).max() > 1e-6  # it has lost samples


def test_records_are_written_one_after_another_and_read_when_the_one_before_has_been_analysed(tmp_path, monkeypatch):
    model = read_rig(RIG).model
    records = simulate_records(model, [88.0, 120.0, 308.0], [0, 1], np.arange(2000) / 4000)
    save_along((records_dataset([one]) for one in records), tmp_path / "r.nc", "speed")
    assert load(tmp_path / "r.nc").equals(records_dataset(records))

    def interrupted():
        yield records_dataset(records[:1])
        raise RotorstudyError("the second record is wrong")

    refused(lambda: save_along(interrupted(), tmp_path / "broken.nc", "speed"), "second record")
    assert [path.name for path in tmp_path.iterdir()] == ["r.nc"]
    happened, assemble, analyse = [], netcdf_files.assemble, measurement.analyse_each
    monkeypatch.setattr(netcdf_files, "assemble", lambda *given: happened.append("read") or assemble(*given))
    monkeypatch.setattr(measurement, "analyse_each", lambda *given: happened.append("analysed") or analyse(*given))
    found = measurement.read_measurement([tmp_path / "r.nc"], RIG, with_signals=False)
    assert happened == ["read", "analysed"] * 3 and found.records == []
    kept = measurement.read_measurement([tmp_path / "r.nc"], RIG)
    np.testing.assert_array_equal(kept.spectrum.amplitude, found.spectrum.amplitude)
    assert [record.speed for record in kept.records] == pytest.approx([88.0, 120.0, 308.0], rel=1e-4)


def test_a_speed_too_low_for_the_record_is_refused_before_anything_is_computed(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("rotorstudy.measurement.records.each_record", lambda *_: pytest.fail("simulated"))
    run("simulate", RIG, "--speeds", *range(100, 200), "1", "--out", tmp_path / "r.nc", status=1)
    assert "simulated record at 1 rad/s: 0.16 revolutions" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
