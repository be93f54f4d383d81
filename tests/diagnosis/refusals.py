"""What commands refuse, and a small rig whose records they accept."""

from rotorstudy.commands.line import main


def refused(capsys, folder, rig, path, *words):
    status = main(["diagnose", str(path), "--rig", str(rig), "--out", str(folder / "out")])
    printed = capsys.readouterr()
    assert status == 1 and printed.out == ""
    error = printed.err.strip().splitlines()[-1]
    assert error.startswith("error: ")
    for word in words:
        assert word in error, error
    assert not (folder / "out").exists() and not list(folder.glob(".*partial"))


RIG = {
    "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
    "effects": [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6},
    ],
    "measurement": {"harmonics": [0, 1, -1]},
}
