"""Damaged files of every kind give numbers or one line: 20,000 always, from a seed ROTORSTUDY_FUZZ_SEED on request."""

import os
import random
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from rotorstudy import RotorstudyError, build_model
from rotorstudy.authoring.ross_model import read_ross
from rotorstudy.measurement import files, text_table
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.measurement.files import open_csv, open_matlab, open_uff
from rotorstudy.measurement.guess import guess_measurement
from rotorstudy.measurement.receptances import _of_csv, receptances_in
from rotorstudy.measurement.table_spectra import read_table
from rotorstudy.measurement.tables import open_table
from rotorstudy.yaml_file import read_yaml

INPUTS = int(os.environ.get("ROTORSTUDY_FUZZ", "20000"))
SEED = int(os.environ.get("ROTORSTUDY_FUZZ_SEED", "1"))
ROOT = Path(__file__).parents[2]
PROBES = [{"channel": "x", "node": 1, "angle_deg": 0, "unit": "um"}, {"channel": "y", "node": 1, "angle_deg": 90}]
GIVEN = {"harmonics": [1, -1], "probes": PROBES}
PIECES = rb', ,, ; " nan inf - # 1e300 1e-320 1_0 1.234,5 null: 1: [ { &a *a x'.split()
PIECES += [b"", b" ", b"\t", b"\n", b"\r\n", b"\0", b"\xff", b"\xef\xbb\xbf", b"- ", b"\n,,\n", b"\xb2", b"9" * 5000]
STATED = [Conventions(**GIVEN), Conventions(**GIVEN, csv={"separator": ";", "decimal": ",", "unit_rows": 1})]
TEXTS = {
    "waves": b"time,x,y,key\n0,1,2,0\n1,2,1,5\n2,1,2,0\n3,2,1,5\n",
    "trailing": b"time,x,y,key\n0,1,2,0,\n1,2,1,5,\n2,1,2,0,\n3,2,1,5,\n",
    "commas": b"time;x;y\ns;um;um\n0,5;1,25;2\n1,5;1;2,5\n2,5;1;1\n3,5;;2\n",
    "harmonics": b"speed_rpm,node,harmonic,amplitude_um,phase_deg\n100,1,1,1,20\n100,1,-1,2,30\n200,1,1,1,2\n",
    "probes": b"speed_rpm,probe,amplitude_um,phase_deg\n100,x,1.5,20\n100,y,2.5,30\n200,x,1,2\n200,y,2,3\n",
    "receptances": b"frequency_Hz,response,force,real,imaginary\n5,4x,4x,1e-8,-2e-9\n6,4x,4x,3e-8,-4e-9\n",
    "wide": b"Speed (rpm),x 1X Amp (um),x 1X Phase (deg)\n100,1,2\n200,2,3\n300,3,4\n",
}


def seeds(folder):
    """{kind: files}: text, rigs, rotors of ROSS, MATLAB and UFF."""
    from uff_files import signal_set, write_sets

    savemat(mat := BytesIO(), {"time": np.arange(4.0), "x": np.eye(2), "s": {"y": np.arange(4)}}, do_compression=True)
    write_sets(folder / "seed.uff", [signal_set("a", 1, np.arange(8) / 10, np.ones(8))])
    rig = (ROOT / "examples" / "jeffcott.yaml").read_bytes()
    ross = (ROOT / "tests/measured/ross/models/supports.toml").read_bytes()
    uff = (folder / "seed.uff").read_bytes()
    return {"text": [*TEXTS.values()], "rig": [rig], "ross": [ross], "mat": [mat.getvalue()], "uff": [uff]}


SUFFIX = {"text": "csv", "rig": "yaml", "ross": "toml"}
HELD = [b""]  # the text of the file that is being read
SHARES = {"text": 0.96, "rig": 0.005, "ross": 0.015, "mat": 0.015, "uff": 0.005}  # by what a reading takes


def damaged(content, rng):
    """Bytes with one to three places replaced by pieces, cut out, or repeated."""
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(content) + 1)
        to = min(len(content), at + rng.choice((0, 1, 1, 2, 9)))
        new = rng.choice(PIECES) if rng.random() < 0.8 else content[at : at + 20] * 2
        content = content[:at] + new + content[to:]
    return content


def read(kind, path, rng, content=b""):
    """The numbers of a file, by one of the ways in which the package reads it."""
    if kind == "text":
        stated, way = STATED[content.count(b";") > 3], rng.randrange(10)
        if b"response" in content:
            return [np.abs(part) for _, *found in _of_csv(path, 0).values() for part in found]
        if way == 0:
            return [guess_measurement(path, (1, 2, 3)).section["rotation"] == 0]
        if way > 1 and (table := open_table(path, stated.csv)):
            of_nodes = [node for one in read_table(table, stated, (1,))[0] for node in one.nodes.values()]
            return [part for node in of_nodes for part in (node.amplitude, node.covariance)]
        found = open_csv(path, stated)
    elif kind in ("mat", "uff"):
        found = (open_matlab if kind == "mat" else open_uff)(path, None)
    else:
        return [build_model(read_yaml(path)).stated] if kind == "rig" else [bool(read_ross(path).sections)]
    return [np.nan_to_num(found.values(name)) for name in found.names]  # NaN is a missing sample


def refused(kind, content, path, rng):
    """Whether the reader of a file with this content refuses it in one line; else its numbers are finite."""
    if kind == "text":
        HELD[0] = content
    else:
        path.write_bytes(content)
    try:
        found = read(kind, path, rng, content)
    except RotorstudyError as error:
        assert "\n" not in str(error)
        return True
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}, for {content!r}") from error
    assert kind == "rig" or all(np.isfinite(one).all() for one in found), content
    return False


def hold_text(patch):
    """Text without the disk, which takes most of the time; the guess of a layout in messages is tried in `read`."""
    patch.setattr(text_table, "_opened", lambda path: text_table.decoded(BytesIO(HELD[0]), path))
    for module in (text_table, files):
        patch.setattr(module, "layout_hint", lambda path, stated: "")


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::ResourceWarning", "ignore::UserWarning")
@pytest.mark.parametrize("kind", SHARES)
def test_damaged_files_give_numbers_or_one_line(kind, tmp_path, monkeypatch):
    rng = random.Random(f"{SEED} {kind}")
    path = tmp_path / f"input.{SUFFIX.get(kind, kind)}"
    path.touch()
    count, contents = max(50, round(INPUTS * SHARES[kind])), seeds(tmp_path)[kind]
    if kind == "text":
        hold_text(monkeypatch)
    lines = sum(refused(kind, damaged(rng.choice(contents), rng), path, rng) for _ in range(count))
    assert 0 < lines < count


def test_a_matlab_file_that_ends_the_process_of_its_reader_is_refused(tmp_path):
    """Sizes of arrays that are not compressed, and so have no checksum, are made larger."""
    path = tmp_path / "a.mat"
    savemat(path, {"x": np.arange(4.0)})
    assert open_matlab(path, None).values("x").tolist() == [0, 1, 2, 3]
    content = bytearray(path.read_bytes())
    at = content.index((5).to_bytes(4, "little") + (8).to_bytes(4, "little")) + 8  # the dimensions of the array
    content[at : at + 8] = (2**30).to_bytes(4, "little") * 2
    path.write_bytes(content)
    with pytest.raises(RotorstudyError, match="not a readable MATLAB file"):
        open_matlab(path, None)


def test_the_seeds_themselves_are_read(tmp_path):
    for name, content in TEXTS.items():
        (tmp_path / "a.csv").write_bytes(content)
        if name == "receptances":
            assert len(receptances_in(tmp_path / "a.csv")[0]) == 2
            continue
        assert guess_measurement(tmp_path / "a.csv", (1, 2, 3)).said, name
