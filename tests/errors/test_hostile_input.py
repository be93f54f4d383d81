"""Input from anyone: a one-line error or a finite result, in bounded time and memory.

A short run always; `ROTORSTUDY_FUZZ=100000 pytest tests/errors/test_hostile_input.py` tries as many inputs.
"""

import copy
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from machines import point
from one_line_errors import refused

from rotorstudy import Spectrum, build_model, eigenvalues, harmonic_response, load_rig, make_term, measured_response
from rotorstudy.commands.line import main
from rotorstudy.errors import LONGEST, RotorstudyError
from rotorstudy.store import load
from rotorstudy.yaml_file import MOST_VALUES, read_yaml

EXAMPLES = int(os.environ.get("ROTORSTUDY_FUZZ", "20"))
SLOW = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]  # on a busy machine, too
FUZZ = settings(max_examples=EXAMPLES, deadline=None, derandomize=EXAMPLES < 1000, suppress_health_check=SLOW)
NESTED = "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True))
MERGED = "".join(
    f"{b}: &{b} {{<<: [{', '.join([f'*{a}'] * 9)}]}}\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE = {
    "alias bomb": (f"a: &a [x, x, x]\n{NESTED}", f"more than {MOST_VALUES} values"),
    "merge bomb": (f"a: &a {{x: 1}}\n{MERGED}", f"more than {MOST_VALUES} values"),
    "an alias in itself": ("rotor: &r {kind: jeffcott, x: *r}\n", "contains itself"),
    "1000 brackets": (f"rotor: {'[' * 1000}{']' * 1000}\n", "within each other|nesting depth"),  # of libyaml
    "5000 digits": (f"rotor: {{mass_kg: {'9' * 5000}}}\n", "whole number"),
    "impossible date": ("rotor: {mass_kg: 2020-13-45}\n", "timestamp"),
    "tagged bytes": ("rotor: {mass_kg: !!binary aGVsbG8=}\n", "binary"),
    "a tagged truth": ("rotor: !!bool abc\n", "not valid YAML"),
    "a tagged number": ("rotor: {mass_kg: !!float abc}\n", "not valid YAML"),
    "Python object": ("rotor: !!python/object/apply:os.system ['true']\n", "line 1.*not valid YAML"),
    "nothing": ("", "expected keys and values"),
    "a number alone": ("3\n", "expected keys and values"),
    "a list": ("- a\n- b\n", "expected keys and values"),
    "a tab": ("rotor:\n\tkind: x\n", "line 2.*not valid YAML: the line begins with a tab; indent it with spaces"),
    "a tab in a list": ("effects:\n  - {kind: bow}\n\t- {kind: bow}\n", "line 3.*begins with a tab"),
    "a decimal comma": ("rotor: {mass_kg: 2,5}\n", "line 1.*'5' has no value; .*decimal point"),
    "no space after a colon": ("effects: [{kind: bow, node:5}]\n", "'node:5' has no value; write a space"),
    "an open bracket": ("rotor: {kind: jeffcott\n", "not valid YAML"),
    "a null byte": (b"a: \x00b\n", "not valid YAML"),
    "a binary file": (b"\xff\xfe\x00\xd8", ""),
    "a key twice": ("rotor: {mass_kg: 2, mass_kg: 3}\n", "mass_kg.*twice"),
    "a date": ("rotor: {mass_kg: 2020-01-01}\n", "line 1.*timestamp"),
    "a list as key": ("? [a]\n: 1\n", "a key must be"),
    "nothing as key": ("rotor: {null: 1}\n", "a key must be"),
    "a fraction as key": ("1.5: 1\n", "a key must be"),
    "not UTF-8": (b"rotor: \xff\xfe\n", "not in UTF-8; save it"),
    "octal digits": ("rotor: {node: 010}\n", "'010': write a number in decimal digits"),
    "hexadecimal digits": ("rotor: {mass_kg: 0x10}\n", "'0x10': write"),
    "minutes and seconds": ("rotor: {mass_kg: 1:30}\n", "'1:30': write"),
    "groups of digits": ("rotor: {mass_kg: 1_0.5}\n", "'1_0.5': write"),
}


def example(name):
    return yaml.safe_load(Path(f"examples/{name}.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_yaml_is_refused_with_the_name_of_the_file(tmp_path, name):
    text, message = HOSTILE[name]
    path = tmp_path / "rig.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert re.search(message, refused(lambda: read_yaml(path), "rig.yaml"))


@pytest.mark.parametrize(
    ("text", "found"),
    [  # a probe on a casing; a merge key; numbers as Python reads them
        ("probe: {on: bearing DE, no: on}\nyes: 1\n", {"probe": {"on": "bearing DE", "no": True}, "yes": 1}),
        ("one: &c {a: 1, b: 50e-6}\ntwo: {<<: *c, b: 2e5}\n", {"one": {"a": 1, "b": 50e-6}, "two": {"a": 1, "b": 2e5}}),
        ("a: [50e-6, 2e-05, 1e5, +.5E3, -3.e2, 7, 0.25, 1.5e+3]", {"a": [50e-6, 2e-5, 1e5, 500, -300, 7, 0.25, 1500]}),
        ("a: [1e, e5, 2e-5 mm, 5e3x, run_1e5]", {"a": ["1e", "e5", "2e-5 mm", "5e3x", "run_1e5"]}),
    ],
)
def test_what_yaml_alone_takes_otherwise_is_read_as_meant(text, found, tmp_path):
    (tmp_path / "rig.yaml").write_text(text)
    assert read_yaml(tmp_path / "rig.yaml") == found


def test_a_message_that_repeats_the_input_is_cut_in_one_line(tmp_path, command):
    path = tmp_path / "rig.yaml"
    path.write_text(f"rotor: {{kind: {'k' * 100_000}}}\n")
    assert_one_line(command("simulate", path, "--speeds", "100", "--out", tmp_path / "o.nc", status=1).err)
    assert len(str(RotorstudyError("a\nb"))) == 3


WEAK = {"rotor": point(2.0, 7e5), "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": 7.1e5}]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rig: rig["cracks"][0].update(stiffness_loss=1e18), "stiffness_loss = 1e"),
        (lambda rig: rig["cracks"][0].update(stiffness_loss=-0.1), "stiffness_loss = -0.1"),
        (lambda rig: rig["rotor"]["elements"][0].update(length_m=1.67e-71), "elements[0].length_m = 1.67e-71"),
        (lambda rig: rig["rotor"]["elements"][0].update(length_m=1e-320), "rig.yaml: must be from 1e-30 to 1e+30"),
        (lambda rig: rig["rotor"].update(youngs_modulus_Pa=1e308), "rotor.youngs_modulus_Pa = 1e+308 in "),
        (lambda rig: rig["rotor"]["discs"][0].update(node=7), "rig.yaml, rotor: unknown node '7'"),
        (lambda rig: rig.update(static_deflection_m={7: 1e-5}), "unknown node '7' in "),
        (lambda rig: rig["rotor"].pop("outer_diameter_m"), "rig.yaml, rotor: finite_element: give outer_diameter_m"),
        (lambda rig: rig["cracks"][0].pop("stiffness_loss"), "rig.yaml: no value for "),
        (lambda rig: rig["effects"][0].update({1: 2}), "key 1 in "),
        (lambda rig: rig["rotor"]["elements"][0].update(count=501), "more than 500 elements"),
        (lambda rig: rig["rotor"]["elements"][0].update(count=10**9), "equal to 1000"),
        (lambda rig: rig["cracks"][0].update(order=10**9), "order = 1000000000 in "),
        (lambda rig: rig["cracks"][0].update(terms=10**9), "equal to 1000"),
        (lambda rig: rig["effects"].append({"kind": "shaft_runout", "highest": 10**9}), "equal to 1000"),
        (lambda rig: rig["effects"][2].update(eccentricity_m=1000.0), "more than the size of the rotor"),
        (lambda rig: rig["effects"][2].update(eccentricity_phase_deg=1e17), "an angle must be within 3600"),
        (lambda rig: rig["effects"][2].update(label={"a": 1}), "must be a text"),
        (lambda rig: (rig.clear(), rig.update(WEAK)), "7e+05 N/m"),  # a node has no more to lose
    ],
)
def test_impossible_numbers_are_refused(tmp_path, capsys, change, message):
    rig = example("two_discs")
    change(rig)
    assert simulated(rig, tmp_path) == 1
    assert message in capsys.readouterr().err


LONG = 10**5000  # longer than Python writes out


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rig: build_model({**example("jeffcott"), "sensors": [LONG]}), "the rig: whole number beyond"),
        (lambda rig: build_model({**example("jeffcott"), "static_deflection_m": {LONG: 0.0}}), "the rig: whole number"),
        (lambda rig: make_term("effect", {"kind": "unbalance", "node": LONG}, rig.structure, [1]), "the term: whole"),
        (lambda rig: harmonic_response(rig, [LONG], [1]), "speeds: give at least one number, in rad/s"),
        (lambda rig: harmonic_response(rig, [], [1]), "speeds: give at least one number, in rad/s"),
        (lambda rig: eigenvalues(rig, [1j]), "speeds: give at least one number, in rad/s"),
        (lambda rig: measured_response(rig, [100.0], [1, LONG]), "harmonics: give whole numbers from -1000 to 1000"),
        (lambda rig: measured_response(rig, [100.0], [1], order=10**9), "order: give whole numbers from -1000 to 1000"),
        (lambda rig: harmonic_response(rig, [100.0], [1], rig.theta[1:]), "theta: give the 5 amplitudes"),
        (lambda rig: harmonic_response(rig, [100.0], [1], [*rig.theta, 1.0]), "theta: give the 5 amplitudes"),
        (lambda rig: harmonic_response(rig, [100.0], [1], LONG), "theta: give the 5 amplitudes"),
    ],
)
def test_impossible_numbers_from_python_are_refused_in_one_line(call, message):
    assert message in refused(lambda: call(load_rig("examples/jeffcott.yaml")))


WITHOUT_CARE = {  # what nobody would type on purpose: the line that answers it
    "analyse examples/jeffcott.yaml --out {}/a --speeds 1e-300 1e300": "give two speeds from 0.001 to 1e+06",
    "simulate {}/units.yaml --speeds 100 --out {}/o.nc": "unknown unit '{{'length': 'mil'}}' in ",
    "simulate {}/twice.yaml --speeds 100 --out {}/o.nc": "twice.yaml: two items share the parameter",
    "new crack my_crack --folder {}/units.yaml": "units.yaml: File exists",
    "new rig machine --folder {} --records {}/wide.csv": "wide.csv: 20000 columns, at most 5000",
    "new rig machine --folder {} --records {}/workbook.csv": "workbook.csv: a workbook or a compressed file",
    "new rig machine --folder {} --records {}/empty.mat": "empty.mat: not a readable MATLAB file (it is empty)",
}


@pytest.mark.parametrize("line", WITHOUT_CARE)
def test_a_command_line_without_care_is_answered_in_one_line(line, tmp_path, command):
    rig = Path("examples/jeffcott.yaml").read_text(encoding="utf-8")
    damping = "  - {kind: external_damping, external_damping_N_s_per_m: 100.0}\n"
    (tmp_path / "units.yaml").write_text(rig + "units: {length: mil}\n", encoding="utf-8")
    (tmp_path / "twice.yaml").write_text(rig + damping, encoding="utf-8")
    (tmp_path / "wide.csv").write_text("\n".join([20000 * "a,"] + 5 * [20000 * "1,"]), encoding="utf-8")
    (tmp_path / "workbook.csv").write_bytes(b"PK\3\4" + bytes(99))
    (tmp_path / "empty.mat").touch()
    before = len(list(tmp_path.iterdir()))
    err = command(*line.format(tmp_path, tmp_path).split(), status=1).err
    assert WITHOUT_CARE[line].format() in err and len(list(tmp_path.iterdir())) == before
    assert_one_line(err)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: path.symlink_to(path), "does not exist"),  # a loop of links
        (lambda path: path.symlink_to("/dev/null"), "is a device or a pipe"),
        (os.mkfifo, "is a device or a pipe"),
    ],
)
def test_a_link_or_a_pipe_as_a_record_is_answered_in_one_line(make, words, tmp_path, command):
    path = tmp_path / "run.nc"
    make(path)
    err = command("import", path, "--rig", "examples/jeffcott.yaml", "--out", tmp_path / "s.nc", status=1).err
    assert words in err and "run.nc" in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("command", "most", "words"),
    [
        (["simulate", "examples/jeffcott.yaml", "--speeds", "100", "--out", "{}/o.nc"], 20000, "cannot be written"),
        (["new", "crack", "my_crack", "--folder", "{}"], 500, "my_crack.py: cannot be written (File too large)"),
        (["demo", "--out", "{}"], 500, "jeffcott.yaml: cannot be written (File too large)"),
    ],
)
def test_a_disk_that_refuses_is_said_in_one_line(command, most, words, tmp_path):
    """A limit of the file size is refused as a full disk is."""
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most})); from rotorstudy.commands.line import main; "
        "sys.exit(main(sys.argv[1:]))"
    )
    call = [sys.executable, "-c", code, *(part.format(tmp_path) for part in command)]
    found = subprocess.run(call, capture_output=True, text=True, timeout=600)
    assert found.returncode == 1
    assert words in found.stderr and found.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_files_are_utf_8_in_a_locale_without_it(tmp_path):
    """The rig has signs that ASCII has not; its findings, with one of them, are on the page of the records."""
    rig = Path("examples/jeffcott.yaml").read_text(encoding="utf-8").replace("effects:", "effects: # ± µm ü", 1)
    (tmp_path / "rig.yaml").write_text(rig, encoding="utf-8")
    code = (
        "import locale, sys; from rotorstudy.commands.line import main; r, o = sys.argv[1:]; "
        "assert 'UTF' not in locale.getpreferredencoding(); "
        "main(['simulate', r, '--speeds', '100', '--rate', '2000', '--out', o + '/r.nc']); "
        "sys.exit(main(['import', o + '/r.nc', '--rig', r, '--out', o + '/s.nc']))"
    )
    locale = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    call = [sys.executable, "-c", code, str(tmp_path / "rig.yaml"), str(tmp_path)]
    found = subprocess.run(call, capture_output=True, env={**os.environ, **locale}, timeout=600)
    assert found.returncode == 0, found.stderr
    page = (tmp_path / "s_quality.html").read_bytes()
    assert "utf-8" in page.decode("utf-8") and any(byte > 127 for byte in page)


WRITING = {
    "simulate examples/jeffcott.yaml --speeds 88 --out {}/a.nc": "--out",
    "analyse examples/jeffcott.yaml --out {}/a": "--out",
    "import {}/r.nc --rig examples/jeffcott.yaml --out {}/a.nc": "--out",
    "identify {}/r.nc --rig examples/jeffcott.yaml --unknowns internal_damping --rig-out {}/a.yaml": "--rig-out",
    "diagnose {}/r.nc --rig examples/jeffcott.yaml --out {}/a": "--out",
    "compare --before {}/r.nc --after {}/s.nc --rig examples/jeffcott.yaml --out {}/a": "--out",
}


@pytest.mark.parametrize("line", WRITING)
def test_a_folder_without_permission_is_told_before_anything_is_read(line, tmp_path, command, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    said = command(*line.replace("{}", str(tmp_path)).split(), status=1).err
    assert said.startswith(f"error: {WRITING[line]} {tmp_path}/a") and f"to write into the folder '{tmp_path}'" in said


def test_output_into_a_closed_pipe_is_no_error_and_a_folder_removed_while_one_works_in_it_is_told(tmp_path):
    plugins = f"{sys.executable} -m rotorstudy plugins"
    piped, removed = (
        subprocess.run(["bash", "-c", call], capture_output=True, text=True, timeout=600)
        for call in (f"{plugins} | head -1; exit ${{PIPESTATUS[0]}}", f"cd {tmp_path} && rmdir {tmp_path} && {plugins}")
    )
    assert piped.returncode == 0 and piped.stderr == ""
    assert removed.returncode == 1 and removed.stderr.endswith("does not exist any more; change to another one\n")


def test_a_terminal_without_the_sign_shows_a_question_mark():
    """± cannot be written in ASCII."""
    code = "from rotorstudy.commands import line; line.main(['plugins', '--name', 'fft']); print('1 ± 2')"
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment, timeout=600)
    assert found.returncode == 0 and found.stdout.endswith(b"1 ? 2\n")


LEAVES = st.floats() | st.integers(-(10**16), 10**16) | st.text(max_size=5) | st.none() | st.booleans()
LEAVES |= st.lists(st.integers(-2, 9), max_size=3) | st.dictionaries(st.text(max_size=3), st.integers(), max_size=2)


def places(value, path=()):
    """Paths of all values within a configuration."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(one for key, part in inside for one in places(part, (*path, key)))]


@st.composite
def mutated_rigs(draw, name):
    """A rig file with one to three of its values replaced or removed."""
    rig = example(name)
    for _ in range(draw(st.integers(1, 3))):
        *above, key = draw(st.sampled_from(places(rig)[1:]))
        part = rig
        for step in above:
            part = part[step]
        if draw(st.integers(0, 4)) == 0:
            del part[key]
        else:
            part[key] = draw(LEAVES)
    return rig


def simulated(rig, folder):
    """Status of `simulate` for a rig."""
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(copy.deepcopy(rig)), encoding="utf-8")
    given = ["simulate", str(path), "--speeds", "100", "--duration", "0.2", "--rate", "2000"]
    return main([*given, "--harmonics", "0", "1", "-1", "2", "--out", str(folder / "o.nc")])


def assert_one_line(err):
    """The last line is the error; findings and warnings may stand before it."""
    *before, last = err.splitlines()
    assert last.startswith("error: ") and len(last) <= LONGEST + 20
    assert all(line.startswith(("error: ", "warning: ", "note: ")) for line in before)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ["jeffcott", "two_discs"])
def test_a_mutated_rig_gives_one_line_or_a_finite_record(tmp_path, capsys, name):
    @FUZZ
    @given(mutated_rigs(name))
    def check(rig):
        status = simulated(rig, tmp_path)
        err = capsys.readouterr().err
        if status:
            assert_one_line(err)
        else:
            assert np.isfinite(load(tmp_path / "o.nc").displacement.values).all()

    check()


def test_the_oracle_sees_a_traceback_and_a_second_line():
    for wrong in ("Traceback (most recent call last)\nerror: a", "error: a\nb", "error: " + "x" * 2 * LONGEST):
        with pytest.raises(AssertionError):
            assert_one_line(wrong)


def test_a_term_of_another_rotor_is_refused():
    one, two = (load_rig(Path(__file__).parents[2] / "examples" / f"{name}.yaml") for name in ("jeffcott", "two_discs"))
    crack = {"kind": "switching", "label": "second", "stiffness_loss_N_per_m": 5e4}
    term = make_term("crack", crack, one.structure, one.sensors)
    refused(lambda: two.plus(term), "a term for a rotor of 1 coordinates, and this one has 10")
    assert len(one.plus(term).terms) == len(one.terms) + 1  # the negative control


@pytest.mark.parametrize(
    ("change", "fits"),
    [
        ({}, True),
        ({"amplitude": np.ones((2, 2, 1))}, False),
        ({"amplitude": np.ones((5, 2, 3, 1))}, True),  # of five trials
        ({"amplitude": np.ones((3, 2, 1))}, False),
        ({"covariance": np.tile(np.eye(3), (2, 1, 1, 1))}, False),
        ({"covariance": None}, False),
        ({"speed": np.array([80.0])}, False),
        ({"sensors": (1, 2)}, False),
    ],
)
def test_a_spectrum_of_other_shapes_is_refused(change, fits):
    given = {"amplitude": np.ones((2, 3, 1)), "speed": np.array([80.0, 90.0]), "harmonics": np.array([1, -1, 2])}
    given |= {"sensors": (1,), "covariance": np.tile(np.eye(6), (2, 1, 1, 1))}
    if fits:
        assert Spectrum(**given | change).sensors == (1,)
    else:
        refused(lambda: Spectrum(**given | change), "a spectrum has amplitude of shape")
