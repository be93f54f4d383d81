"""A wrong plugin of every kind, in `rotorstudy check` and in use: one line that names the file, and no traceback."""

import pytest
from one_line_errors import run

from rotorstudy.authoring.files import new_plugin
from rotorstudy.commands.line import main

BODY = {  # what the template of each kind gives back, first and last line of it
    "rotor": ("    return Structure(", "    )\n"),
    "crack": ("    return ((1", "** 2\n"),
    "depth": ("    return weak", "/ 2\n"),
    "bearing": ("    return [", "]\n"),
    "effect": ("    return [", "]\n"),
    "spectrum": ("    return amplitude", "lines)\n"),
    "estimator": ("    return output_error_fit", "problem))\n"),
}
TWO = "((1, 'translation'), (2, 'translation'))"
SHAPE = {  # what a wrong one gives back instead, and words of the answer
    "rotor": (f"    return Structure(np.eye(2), np.eye(3), np.eye(2), np.ones(2), {TWO})",
              "stiffness of shape (3, 3); it must be (2, 2)"),
    "crack": ("    return np.ones((2, *np.shape(angle)))", "gives a breathing function of shape (2, "),
    "depth": ("    return weak", "must be two finite compliances"),
    "bearing": ('    return [Parameter("k", "N/m", (Entry(-np.eye(3)),), typical=1e7)]', "shape (3, 3); on 'z'"),
    "effect": ('    return [Parameter("c", "N s/m", (Entry(-np.eye(3)),), typical=50.0)]', "shape (3, 3); on 'z'"),
    "spectrum": ("    return amplitude[..., 1:], None", "gives amplitude of shape ("),
    "estimator": ("    found = output_error_fit(problem)\n"
                  "    return type(found)(found.names, found.theta[..., 1:], found.covariance, found.misfit)",
                  "gives theta of shape ("),
}  # fmt: skip
NOT_A_NUMBER = {
    "rotor": (f"    return Structure(np.eye(2), np.nan * np.eye(2), np.eye(2), np.ones(2), {TWO})",
              "stiffness with NaN"),
    "crack": ("    return np.nan * angle", "gives NaN or infinity, first at an angle of"),
    "depth": ("    return weak, np.nan", "must be two finite compliances"),
    "bearing": ('    return [Parameter("k", "N/m", (Entry(-np.nan * here),), typical=1e7)]', "is not finite"),
    "effect": ('    return [Parameter("c", "N s/m", (Entry(-np.outer(here, here), gain=lambda w: np.nan * w),), 50.0)]',
               "is not finite at"),
    "spectrum": ("    return np.nan * amplitude, np.zeros((*amplitude.shape[:-1], 2 * len(lines), 2 * len(lines)))",
                 "gives amplitude with NaN"),
    "estimator": ("    found = output_error_fit(problem)\n    found.theta[:] = np.nan\n    return found", "gives NaN"),
}  # fmt: skip
RAISES = dict.fromkeys(BODY, ("    return 1 / 0", "ZeroDivisionError: division by zero"))
NOTHING = {
    "rotor": ("    return None", "gives NoneType; it must give a Structure"),
    "crack": ("    return None", "gives a breathing function of shape"),
    "depth": ("    return None", "must be two finite compliances"),
    "bearing": ("    return None", "gives NoneType; it must give a list of Parameter"),
    "effect": ("    return None", "gives NoneType; it must give a list of Parameter"),
    "spectrum": ("    return None", "gives one NoneType; it must give two arrays"),
    "estimator": ("    return None", "gives NoneType; it must give an Estimate"),
}
WITHOUT_UNIT = {
    "bearing": ('    return [Parameter("k", "", (Entry(-here),), typical=1e7)]', "has no unit"),
    "effect": ('    return [Parameter("c", "", (Entry(-np.outer(here, here)),), typical=50.0)]', "has no unit"),
}
NO_TUPLE = {
    "bearing": ('    return [Parameter("k", "N/m", (Entry(-here)), typical=1e7)]', "with a comma"),
    "effect": ('    return [Parameter("c", "N/m", (Entry(-np.outer(here, here))), typical=1.0)]', "with a comma"),
}
HERE = "Entry(-np.outer(here, here)"


def gives(entry, typical="1.0"):
    return f'    return [Parameter("c", "N/m", ({entry},), typical={typical})]'


OTHERS = [  # kind, what is wrong, what is given back and answered
    ("bearing", "entry", gives('Entry(-here, on="conjugate")'), "has on = 'conjugate'"),
    ("effect", "entry", gives(f"{HERE}, order=1.5)"), "order = 1.5"),
    ("effect", "gain", gives(f"{HERE}, gain=3.0)"), "`gain` a function of the speed"),
    ("effect", "numbers", gives(f"{HERE}.astype(object))"), "matrix of numbers"),
    ("effect", "size", gives(f"{HERE})", 'float("nan")'), "typical = nan"),
    ("effect", "writes", "    structure.stiffness[:] *= 2\n    return None", "is read-only"),
    ("crack", "complex", "    return np.exp(1j * angle)", "gives complex numbers; shares of a loss are real"),
    *((kind, "exits", "    import sys\n\n    sys.exit(0)", "SystemExit: 0") for kind in ("crack", "effect")),
]
TABLES = {"shape": SHAPE, "NaN": NOT_A_NUMBER, "raises": RAISES, "nothing": NOTHING, "unit": WITHOUT_UNIT}
TABLES |= {"tuple": NO_TUPLE}
OTHERS += [(kind, name, *case) for name, cases in TABLES.items() for kind, case in cases.items()]
WRONG = [pytest.param(kind, *case, id=f"{kind}-{name}") for kind, name, *case in OTHERS]

JEFFCOTT = "rotor: {kind: jeffcott, mass_kg: 2.0, stiffness_N_per_m: 7.6e+5}\n"
UNBALANCE = "effects:\n  - {kind: external_damping, external_damping_N_s_per_m: 100.0}\n"
UNBALANCE += "  - {kind: unbalance, eccentricity_m: 5.0e-6}\n"
RIG = {
    "rotor": "rotor: {kind: mine, disc_mass_kg: 2.0, stiffness_N_per_m: 7.6e+5}\n"
    + UNBALANCE.replace("}", ", node: 1}"),
    "crack": JEFFCOTT + "cracks: [{kind: mine, stiffness_loss_N_per_m: 1.0e+5}]\n" + UNBALANCE,
    "depth": JEFFCOTT + UNBALANCE
    + "cracks: [{kind: switching, depth: {kind: mine, depth_ratio: 0.3, diameter_m: 0.02, span_m: 0.45}}]\n",
    "bearing": JEFFCOTT + "bearings: [{kind: mine, k_N_per_m: 1.0e+7}]\n" + UNBALANCE,
    "effect": JEFFCOTT + UNBALANCE + "  - {kind: mine, c_N_s_per_m: 50.0}\n",
    "spectrum": JEFFCOTT + UNBALANCE,
    "estimator": JEFFCOTT + UNBALANCE,
}  # fmt: skip


@pytest.fixture
def wrong_plugin(tmp_path, monkeypatch):
    """A function that writes a plugin 'mine' of a kind which gives back something else, and puts it in the zoo."""

    def write(kind, body):
        path = new_plugin(kind, "mine", tmp_path / "zoo")
        text = path.read_text().replace("    series=series,\n", "")
        first, last = BODY[kind]
        start = text.index(first)
        end = text.index(last, start) + len(last.split("\n")[0])
        text = text[:start] + body + text[end:]
        if "np." in body and "import numpy" not in text:
            text = "import numpy as np\n\n" + text
        path.write_text(text)
        monkeypatch.setenv("ROTORSTUDY_PLUGINS", str(tmp_path / "zoo"))
        return path

    return write


@pytest.mark.parametrize(("kind", "body", "words"), WRONG)
def test_a_wrong_plugin_fails_its_check_with_file_and_shapes(wrong_plugin, command, kind, body, words):
    path = wrong_plugin(kind, body)
    said = command("check", path, status=1).out
    assert words in said and "Traceback" not in said
    assert all(str(path) in line for line in said.splitlines() if words in line)


@pytest.mark.parametrize(("kind", "body", "words"), WRONG)
def test_a_wrong_plugin_in_use_is_named_with_file_and_shapes(wrong_plugin, tmp_path, capsys, kind, body, words):
    rig, records = tmp_path / "rig.yaml", tmp_path / "records.nc"
    short = ["--duration", "0.6", "--rate", "3000"]
    rig.write_text(RIG[kind])
    if kind in ("spectrum", "estimator"):
        run("simulate", rig, "--speeds", "88", "199", *short, "--out", records)
    path = wrong_plugin(kind, body)
    capsys.readouterr()
    if kind in ("spectrum", "estimator"):
        status = main(["identify", str(records), "--rig", str(rig), "--unknowns", "external_damping",
                       f"--{kind}", "mine"])  # fmt: skip
    else:
        status = main(["simulate", str(rig), "--speeds", "88", *short, "--out", str(records)])
    said = capsys.readouterr().err.splitlines()
    assert status == 1 and len(said) == 1 and said[0].startswith("error: ")
    assert words in said[0] and str(path) in said[0]


MISTAKES = [
    ("return None", "return (None", "SyntaxError"),
    ("the paper and equation it comes from", "", "has no source"),
    ('    source="the paper and equation it comes from",\n', "", "has no source"),
    ("from rotorstudy", "import sys; sys.exit(0)\nfrom rotorstudy", "SystemExit: 0"),
    ("checked=", "cheked=", "unknown property 'cheked' in @Effect; did you mean 'checked'"),
]
OF_KINDS = [
    *(("effect", *mistake) for mistake in MISTAKES),
    *((kind, *MISTAKES[0]) for kind in BODY if kind != "effect"),
]


@pytest.mark.parametrize(("kind", "old", "new", "words"), OF_KINDS)
def test_a_plugin_without_source_or_that_does_not_parse_is_named(wrong_plugin, tmp_path, capsys, kind, old, new, words):
    path = wrong_plugin(kind, "    return None")
    path.write_text(path.read_text().replace(old, new))
    run("check", path, status=1)
    said = capsys.readouterr().err.splitlines()
    assert words in said[-1] and str(path) in said[-1]
    (tmp_path / "rig.yaml").write_text(RIG[kind])
    command = ["simulate", str(tmp_path / "rig.yaml"), "--speeds", "88", "--out", str(tmp_path / "records.nc")]
    if kind in ("spectrum", "estimator"):
        command = ["identify", "none.nc", "--rig", str(tmp_path / "rig.yaml"), f"--{kind}", "mine"]
    assert main(command) == 1
    said = capsys.readouterr().err.splitlines()
    assert f"unknown {kind} 'mine'" in said[-1] and words in said[-1] and str(path) in said[-1]


def test_a_plugin_that_does_not_load_is_named_with_its_line(wrong_plugin, monkeypatch, capsys):
    path = wrong_plugin("effect", "    return None")
    path.write_text(path.read_text().replace("@Effect", "@Efect"))
    line = path.read_text().split("@Efect")[0].count("\n") + 1
    monkeypatch.delenv("ROTORSTUDY_PLUGINS")
    monkeypatch.chdir(path.parent)
    run("check", path.name, status=1)
    assert f"plugin mine.py:{line}: NameError" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("force", "words"),
    [("np.ones(3)", "has shape (3,); it must be that of the displacement"), ("np.nan * z", "is NaN for a finite")],
)
def test_a_wrong_force_in_time_is_named_with_file_and_shapes(wrong_plugin, tmp_path, capsys, command, force, words):
    body = f"""    from rotorstudy.model.terms import NonlinearForce
    return [Parameter("c", "N s/m", (), 50.0, force=NonlinearForce(here[None], lambda z, v, still: {force}))]"""
    path = wrong_plugin("effect", body)
    (tmp_path / "rig.yaml").write_text(RIG["effect"])
    run("simulate", tmp_path / "rig.yaml", "--speeds", "88", "--out", tmp_path / "r.nc", status=1)
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and words in said[0] and str(path) in said[0]
    assert words in command("check", path, status=1).out
