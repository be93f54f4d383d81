"""A wrong plugin of every kind, in `rotorstudy check` and in use: one line that names the file, and no traceback."""

import pytest
from one_line_errors import run

from rotorstudy.authoring.files import new_plugin

BODY = {  # what the template of each kind gives back, first and last line of it
    "rotor": ("    return Structure(", "    )\n"),
    "crack": ("    return ((1", "** 2\n"),
    "depth": ("    return weak", "/ 2\n"),
    "bearing": ("    return [", "]\n"),
    "effect": ("    return [", "]\n"),
    "spectrum": ("    return amplitude", "lines)\n"),
    "estimator": ("    return output_error_fit", "problem))\n"),
}


def gives(entry, typical="1.0", unit="N s/m"):
    return f'    return [Parameter("c", "{unit}", ({entry},), typical={typical})]'


def fitted(change):
    return f"    found = output_error_fit(problem)\n    {change}"


TWO = "((1, 'translation'), (2, 'translation'))"
FEWER = "return type(found)(found.names, found.theta[..., 1:], found.covariance, found.misfit)"
HERE = "Entry(-np.outer(here, here)"
WRONG = [  # kind, what is wrong, what is given back instead, and words of the answer
    ("rotor", "shape", f"    return Structure(np.eye(2), np.eye(3), np.eye(2), np.ones(2), {TWO})",
     "stiffness of shape (3, 3); it must be (2, 2)"),
    ("crack", "shape", "    return np.ones((2, *np.shape(angle)))", "gives a breathing function of shape (2, "),
    ("depth", "shape", "    return weak", "must be two finite compliances"),
    ("spectrum", "shape", "    return amplitude[..., 1:], None", "gives amplitude of shape ("),
    ("estimator", "shape", fitted(FEWER), "gives theta of shape ("),
    ("rotor", "NaN", f"    return Structure(np.eye(2), np.nan * np.eye(2), np.eye(2), np.ones(2), {TWO})",
     "stiffness with NaN"),
    ("crack", "NaN", "    return np.nan * angle", "gives NaN or infinity, first at an angle of"),
    ("depth", "NaN", "    return weak, np.nan", "must be two finite compliances"),
    ("bearing", "NaN", gives("Entry(-np.nan * here)"), "is not finite"),
    ("effect", "NaN", gives(f"{HERE}, gain=lambda w: np.nan * w)"), "is not finite at"),
    ("spectrum", "NaN",
     "    return np.nan * amplitude, np.zeros((*amplitude.shape[:-1], 2 * len(lines), 2 * len(lines)))",
     "gives amplitude with NaN"),
    ("estimator", "NaN", fitted("found.theta[:] = np.nan\n    return found"), "gives NaN"),
    ("rotor", "nothing", "    return None", "gives NoneType; it must give a Structure"),
    ("crack", "nothing", "    return None", "gives a breathing function of shape"),
    ("depth", "nothing", "    return None", "must be two finite compliances"),
    ("spectrum", "nothing", "    return None", "gives one NoneType; it must give two arrays"),
    ("estimator", "nothing", "    return None", "gives NoneType; it must give an Estimate"),
    ("bearing", "entry", gives('Entry(-here, on="conjugate")'), "has on = 'conjugate'"),
    ("effect", "entry", gives(f"{HERE}, order=1.5)"), "order = 1.5"),
    ("effect", "order", gives(f"{HERE}, order=3)"), "`order` 0, 1 or 2"),
    ("effect", "text", gives(f"{HERE}, gain=lambda w: 'w')"), "gives str; it must give numbers"),
    ("effect", "twice", gives(f"{HERE})").replace("[", "2 * [", 1), "gives two parameters called 'c'; rename one"),
    ("effect", "gain", gives(f"{HERE}, gain=3.0)"), "`gain` a function of the speed"),
    ("effect", "numbers", gives(f"{HERE}.astype(object))"), "matrix of numbers"),
    ("effect", "size", gives(f"{HERE})", 'float("nan")'), "typical = nan"),
    ("effect", "writes", "    structure.stiffness[:] *= 2\n    return None", "is read-only"),
    ("crack", "complex", "    return np.exp(1j * angle)", "gives complex numbers; shares of a loss are real"),
    *((kind, "exits", "    import sys\n\n    sys.exit(0)", "SystemExit: 0") for kind in ("crack", "effect")),
    *((kind, "raises", "    return 1 / 0", "ZeroDivisionError: division by zero") for kind in BODY),
]  # fmt: skip
for kind, entry in (("bearing", "Entry(-here)"), ("effect", f"{HERE})")):
    WRONG += [
        (kind, "shape", gives("Entry(-np.eye(3))"), "shape (3, 3); on 'z'"),
        (kind, "nothing", "    return None", "gives NoneType; it must give a list of Parameter"),
        (kind, "unit", gives(entry, unit=""), "has no unit"),
        (kind, "tuple", gives(entry).replace(",), typical", "), typical"), "with a comma"),
    ]

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
SHORT = ["--duration", "0.6", "--rate", "3000"]


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


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """Records from which a plugin of spectra or an estimator can identify."""
    folder = tmp_path_factory.mktemp("records")
    (folder / "rig.yaml").write_text(RIG["spectrum"])
    run("simulate", folder / "rig.yaml", "--speeds", "88", "199", *SHORT, "--out", folder / "records.nc")
    return folder / "records.nc"


def said_in_use(command, kind, records, folder):
    """What a command says that uses the plugin 'mine' of a kind, and fails."""
    rig = folder / "rig.yaml"
    rig.write_text(RIG[kind])
    if kind in ("spectrum", "estimator"):
        given = ["identify", records, "--rig", rig, "--unknowns", "external_damping", f"--{kind}", "mine"]
    else:
        given = ["simulate", rig, "--speeds", "88", *SHORT, "--out", folder / "records.nc"]
    return command(*given, status=1).err.splitlines()


@pytest.mark.parametrize(("kind", "body", "words"), [pytest.param(k, *case, id=f"{k}-{n}") for k, n, *case in WRONG])
def test_a_wrong_plugin_is_named_with_file_and_shapes(wrong_plugin, records, tmp_path, command, kind, body, words):
    """By its check, and in use."""
    path = wrong_plugin(kind, body)
    checked = command("check", path, status=1).out
    assert words in checked and "Traceback" not in checked
    assert all(str(path) in line for line in checked.splitlines() if words in line)
    (said,) = said_in_use(command, kind, records, tmp_path)
    assert said.startswith("error: ") and words in said and str(path) in said


MISTAKES = [
    ("return None", "return (None", "SyntaxError"),
    ("the paper and equation it comes from", "", "has no source"),
    ('    source="the paper and equation it comes from",\n', "", "has no source"),
    ("from rotorstudy", "import sys; sys.exit(0)\nfrom rotorstudy", "SystemExit: 0"),
    ("checked=", "cheked=", "unknown property 'cheked' in @Effect; did you mean 'checked'"),
    ("@Effect", "@Efect", "NameError: name 'Efect'"),
]
OF_KINDS = [
    *(("effect", *mistake) for mistake in MISTAKES),
    *((kind, *MISTAKES[0]) for kind in BODY if kind != "effect"),
]


@pytest.mark.parametrize(("kind", "old", "new", "words"), OF_KINDS)
def test_a_plugin_that_cannot_be_read_is_named(wrong_plugin, records, tmp_path, command, kind, old, new, words):
    """Without a source, or one that does not parse."""
    path = wrong_plugin(kind, "    return None")
    path.write_text(path.read_text().replace(old, new))
    checked = command("check", path, status=1).err.splitlines()[-1]
    assert words in checked and str(path) in checked
    said = said_in_use(command, kind, records, tmp_path)[-1]
    assert f"unknown {kind} 'mine'" in said and words in said and str(path) in said


@pytest.mark.parametrize(
    ("force", "words"),
    [
        ("z, v, still: np.ones(3)", "has shape (3,); it must be that of the displacement"),
        ("z, v, still: np.nan * z", "is NaN for a finite"),
        ("z, v: -z", "the function of the force of 'c' must take displacement, velocity, deflection"),
    ],
)
def test_a_wrong_force_in_time_is_named_with_file_and_shapes(wrong_plugin, tmp_path, command, force, words):
    body = f"""    from rotorstudy.model.terms import NonlinearForce
    return [Parameter("c", "N s/m", (), 50.0, force=NonlinearForce(here[None], lambda {force}))]"""
    path = wrong_plugin("effect", body)
    (said,) = said_in_use(command, "effect", None, tmp_path)
    assert words in said and str(path) in said
    assert words in command("check", path, status=1).out
