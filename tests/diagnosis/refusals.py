"""What commands refuse, and a small rig whose records they accept."""

from machines import jeffcott_rig

from rotorstudy.commands.line import main


def undiagnosed(capsys, folder, rig, path, *words):
    status = main(["diagnose", str(path), "--rig", str(rig), "--out", str(folder / "out")])
    printed = capsys.readouterr()
    assert status == 1 and printed.out == ""
    error = printed.err.strip().splitlines()[-1]
    assert error.startswith("error: ")
    for word in words:
        assert word in error, error
    assert not (folder / "out").exists() and not list(folder.glob(".*partial"))


RIG = jeffcott_rig(measurement={"harmonics": [0, 1, -1]})
