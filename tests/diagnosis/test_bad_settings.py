"""Wrong options, settings, rigs and imported spectra end in a clear error."""

import numpy as np
import pytest
import xarray as xr
import yaml
from one_line_errors import RIG, refused, undiagnosed

from rotorstudy import build_model
from rotorstudy.diagnosis.settings import check_names, read_settings
from rotorstudy.store import load


def test_a_spectrum_that_cannot_be_trusted_is_refused(spectrum, tmp_path, capsys):
    path, rig = spectrum
    data = load(path)
    broken = data.copy(deep=True)
    broken.amplitude[0, 0, 0, 0] = np.nan
    silent = data.copy(deep=True)
    silent.covariance[:] = 0
    twice = xr.concat([data.isel(speed=[0]), data.isel(speed=[0])], "speed", data_vars="minimal")
    for name, changed, word in (("nan", broken, "NaN"), ("zero", silent, "all zero"), ("twice", twice, "twice")):
        changed.to_netcdf(tmp_path / f"{name}.nc")
        capsys.readouterr()
        undiagnosed(capsys, tmp_path, rig, tmp_path / f"{name}.nc", f"{name}.nc", word)


def test_what_the_command_line_refuses(spectrum, tmp_path, capsys, command):
    path, rig = spectrum
    base = ["diagnose", str(path), "--rig", str(rig)]
    (tmp_path / "file").write_text("precious")
    capsys.readouterr()
    for options, words in (
        (["--out", str(tmp_path / "file")], ["is a file"]),
        (["--out", str(tmp_path)], ["contains an input"]),
        (["--out", str(tmp_path / "no" / "out")], ["does not exist"]),
        (["--out", str(tmp_path / "out"), "--hold-out", "150"], ["150", "not measured", "100 and 200"]),
        (["--out", str(tmp_path / "out"), "--hold-out", "100", "200"], ["every speed"]),
    ):
        error = command(*base, *options, status=1).err
        assert error.startswith("error: ") and all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"model_eror": 0.1}, ["model_eror", "did you mean 'model_error'"]),
        ({"model_error": -0.1}, ["model_error = -0.1"]),
        ({"uncertainty": {"eccentricty": 0.1}}, ["eccentricty", "did you mean 'eccentricity'", "uncertainty"]),
        ({"uncertainty": {"default": -0.1}}, ["default = -0.1", "not be negative"]),
        ({"nuisance": {"probe_gian": 0.1}}, ["probe_gian", "did you mean 'probe_gain'"]),
        ({"nuisance": {"unbalance": 0.1}}, ["unbalance", "measuring chain"]),
        ({"nuisance": {"probe_gain": 0.0}}, ["probe_gain = 0", "positive"]),
        ({"base_rates": {"bwo": 2.0}}, ["bwo", "did you mean 'bow'"]),
        ({"base_rates": {"bow": 0.0}}, ["base_rates.bow", "greater than 0"]),
        ({"leave_out": ["bwo"]}, ["bwo", "did you mean 'bow'"]),
        ([1], ["expected keys and values"]),
    ],
)
def test_settings_are_checked_with_near_misses(given, words):

    def checked():
        settings = read_settings({**RIG, "diagnosis": given}, "rig.yaml")
        check_names(settings, build_model(RIG), "rig.yaml, diagnosis")

    refused(checked, "rig.yaml, diagnosis", *words)


def test_a_rig_without_values_is_refused(spectrum, tmp_path, capsys):
    path, _ = spectrum
    rig = tmp_path / "empty_rig.yaml"
    effects = [{"kind": "external_damping"}, RIG["effects"][1]]
    rig.write_text(yaml.safe_dump({**RIG, "effects": effects}))
    capsys.readouterr()
    undiagnosed(capsys, tmp_path, rig, path, "external_damping", "no value")
