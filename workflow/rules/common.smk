# Configuration, checked before anything runs, and what every rule shares.
import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(workflow.basedir)
# the package `thesis`, for these rules and for the scripts, which are processes of their own
sys.path.insert(0, str(ROOT / "workflow"))
os.environ.update(PYTHONPATH=os.pathsep.join(filter(None, [str(ROOT / "workflow"), os.environ.get("PYTHONPATH")])))
# one BLAS thread per job: jobs share the cores, and the order of summation does not depend on the load
threads = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
os.environ.update(threads, MPLBACKEND="Agg")
folders = os.pathsep.join(str(ROOT / folder) for folder in config.get("plugin_folders", []))
if folders:
    os.environ.update(ROTORSTUDY_PLUGINS=folders)

results = str(config.get("results", ""))
for folder, use in (
    (os.getcwd(), "where results are written"),
    (results if os.path.exists(results) else None, "where results are written"),
    (os.environ.get("TMPDIR"), "stated by TMPDIR"),
):
    if folder and not (os.path.isdir(folder) and os.access(folder, os.W_OK)):
        sys.exit(f"error: {folder}, {use}, is not a folder that can be written to; choose another or change its rights")

try:
    from rotorstudy.blind.config import load_blind
    from rotorstudy.errors import RotorstudyError, unknown_name
    from rotorstudy.model.registry import registry
    from rotorstudy.presentation.captions import BLIND_FIGURES, DIAGNOSIS_FIGURES
    from rotorstudy.studies.comparison.config import load_comparison
    from rotorstudy.studies.config import file_name, load_study, named_methods
    from rotorstudy.studies.crack_study.config import load_crack_study
    from rotorstudy.studies.cracks import load_cracks
    from thesis.config import check_replay, load_replay
    from rotorstudy.studies import workflow as jobs
    from rotorstudy.studies.workflow import WorkflowConfig, code_digest, plugin_files
    from rotorstudy.model.configuration import check_config
    from rotorstudy.store import write_text
    from rotorstudy.yaml_file import base_of, read_yaml
except ImportError as error:
    sys.exit(f"error: {error}; activate the environment that `make` made (. .venv/bin/activate), or run `make`")

try:
    settings = check_config(WorkflowConfig, dict(config), "the workflow configuration")
    STUDIES = {name: load_study(ROOT / path) for name, path in settings.studies.items()}
    REPLAYS = {name: load_replay(ROOT / path) for name, path in settings.replays.items()}
    COMPARISON = load_comparison(ROOT / settings.compare) if settings.compare else None
    BLIND = load_blind(ROOT / settings.blind) if settings.blind else None
    if COMPARISON:
        COMPARISON.check(STUDIES, REPLAYS)
    CRACKS = load_cracks(ROOT / settings.cracks) if settings.cracks else None
    CRACK_STUDY = load_crack_study(ROOT / settings.crack_study) if settings.crack_study else None
    for study in STUDIES.values():
        study.check_rigs()
    for name in ("chapter_2", "chapter_4"):
        if name in STUDIES:
            STUDIES[name].check_shown(2)
    for replay in REPLAYS.values():
        check_replay(replay, ROOT / settings.reference)
    for name, item in settings.diagnoses.items():
        if item.replay and item.replay not in REPLAYS:
            raise unknown_name("replay", item.replay, REPLAYS, f"the workflow configuration, diagnoses.{name}")
    for failure in registry().failures:
        print(f"warning: {failure}", file=sys.stderr)
except RotorstudyError as error:
    sys.exit(f"error: {error}")

RESULTS = settings.results
REFERENCE = str(ROOT / settings.reference)
PUBLISHED = [f"{REFERENCE}/{name}.csv" for name in ("full_spectrum", "identified_parameters")]


STATED = [ROOT / path for path in [*settings.studies.values(), *settings.replays.values(), settings.crack_study] if path]
BASES = {base for path in STATED if (base := base_of(path, read_yaml(path)))}


def published_folder(wildcards, input):
    return str(Path(input.published[0]).parent)


wildcard_constraints:
    replay="|".join(REPLAYS) or "none",


SCRIPTS = ROOT / "workflow" / "scripts"


def run_script(name, *given):
    """Run a script in a process of its own; given are input, output, params, wildcards, threads, log of the job."""
    keys = ("input", "output", "params", "wildcards", "threads", "log")
    jobs.run_script(SCRIPTS / name, SimpleNamespace(config=config, **dict(zip(keys, given, strict=True))))


def code(script, *functions):
    """Digest of a script and the files of rotorstudy that it, or functions it is given by name, depend on, and of BASES.

    Snakemake does not track them. As a param, not as inputs: it would look up each of a hundred files before each job.
    """
    return code_digest(SCRIPTS / script, *functions, files=sorted(BASES))


def study_plugins(study, *kinds):
    """Files of the plugins that a study's rigs name, and of its methods of some kinds."""
    return plugin_files(study.rigs.values(), [p for kind in kinds for p in study.methods[kind].values()])


def replay_methods(wildcards):
    replay = REPLAYS[wildcards.replay]
    return named_methods(replay.spectra, replay.estimators, f"replay {replay.name}")


def replay_config(wildcards):
    return str(ROOT / settings.replays[wildcards.replay])


def in_report(path, caption, category, subcategory):
    """A file shown in the HTML report, with its caption from workflow/report.

    Items with the same label would hide each other: files of a wildcard are named by it too, and tables beside figures.
    """
    name = re.sub(r"^(figure|table) (\d+) (\d+)$", numbered, Path(path).stem.replace("_", " "))
    name += " (table)" * (subcategory == "Tables" and not name.startswith("table"))
    kept = [part.strip("{}") for part in Path(path).parts if "{" in part]

    def label(wildcards):
        named = [*(wildcards[key].replace("_", " ") for key in kept), "verdict" if name == "index" else name]
        return {"what": sentence(": ".join(named))}

    if caption not in CAPTIONS:  # else it is missed when the report is written, after everything has run
        raise WorkflowError(f"no caption for {path}: state {caption} in workflow/report/captions.yaml")
    text = Path(".snakemake", "captions", f"{caption}.rst")  # Snakemake reads captions from files
    if not text.is_file() or text.read_text(encoding="utf-8") != CAPTIONS[caption]:
        write_text(text, CAPTIONS[caption])
    return report(
        path,
        caption=str(text.resolve()),
        category=category,
        subcategory=subcategory,
        labels=label,
    )


def numbered(found):
    """Figure 5.4, with a hair space before a single digit: the report sorts by letters, and 5.10 follows 5.4."""
    kind, chapter, number = found.groups()
    return f"{kind} {chapter}.{number if len(number) > 1 else chr(0x200A) + number}"


def sentence(text):
    return text[:1].upper() + text[1:]


def heading(chapter):
    return chapter.replace("_", " ").capitalize()


CAPTIONED = read_yaml(ROOT / "workflow" / "report" / "captions.yaml")
CAPTIONS = {
    **{f"diagnosis_{name}": text for name, (_, text) in DIAGNOSIS_FIGURES.items()},
    **{f"blind_{name}": text for name, text in BLIND_FIGURES.items()},
    **CAPTIONED.pop("pages"),
}
for group, parts in CAPTIONED.items():
    named = {**parts.get("figures", {}), **parts.get("tables", {}), **parts}
    CAPTIONS |= {f"{group}_{name}": text for name, text in named.items() if isinstance(text, str)}
TABLES, FIGURES = (
    {group: list(parts[kind]) for group, parts in CAPTIONED.items() if kind in parts} for kind in ("tables", "figures")
)
FIGURES |= {"diagnosis": list(DIAGNOSIS_FIGURES), "blind": list(BLIND_FIGURES)}
for name, replay in REPLAYS.items():
    FIGURES[name] = list(replay.figures)
    TABLES[name] = [f"table_{sheet}".replace(".", "_") for sheet in replay.sheets] + ["estimates", "physical_checks", "response"]
CHAPTERS = sorted(chapter for chapter in TABLES if chapter in STUDIES or chapter in REPLAYS)


def chapter_config(chapter):
    return str(ROOT / {**settings.studies, **settings.replays}[chapter])


def loader(chapter):
    """Full name of the function that reads the configuration of a chapter."""
    return "thesis.config.load_replay" if chapter in REPLAYS else "rotorstudy.studies.config.load_study"


def module(chapter, of_replays):
    """The module of `thesis` with the tables or figures of a chapter; replays share one."""
    return of_replays if chapter in REPLAYS else chapter


def trials(chapter, rig):
    """Monte Carlo trials of a rig; Chapter 4 has one case."""
    found = [f"{RESULTS}/{chapter}/monte_carlo/{rig}/{file_name(case)}.nc" for case in STUDIES[chapter].cases]
    return found[0] if chapter == "chapter_4" else found


def figure_inputs(chapter):
    """Results that the figures of a chapter show."""
    base = f"{RESULTS}/{chapter}"
    if chapter in REPLAYS:
        return {stage: f"{base}/{stage}.nc" for stage in ("records", "spectra", "identification")}
    stages = ["bias", "weight_dominance", "stability"]
    stages += ["whirl", "identifiability"] * (chapter != "chapter_2") + ["sensors", "variants"] * (chapter == "chapter_6")
    return {
        "records": f"{base}/records/physical.nc",
        "spectra": f"{base}/spectra/physical.nc",
        "thesis_spectra": f"{base}/spectra/thesis.nc",
        "monte_carlo": trials(chapter, "physical"),
        **({} if chapter == "chapter_6" else {"monte_carlo_thesis": trials(chapter, "thesis")}),
        **{stage: f"{base}/{stage}.nc" for stage in stages},
    }


def table_inputs(chapter):
    """Results that the tables of a chapter put beside the thesis's."""
    base = f"{RESULTS}/{chapter}"
    if chapter in REPLAYS:
        return {stage: f"{base}/{stage}.nc" for stage in ("spectra", "identification")}
    found = {"spectra": f"{base}/spectra/thesis.nc"}
    if chapter == "chapter_6":
        return found | {"variants": f"{base}/variants.nc"}
    return found | {"identification": f"{base}/identification/thesis.nc", "monte_carlo": trials(chapter, "thesis")}


def table_pages(chapter):
    """HTML pages of a chapter's tables, each with its caption in the report."""
    pages = {name: f"{RESULTS}/{chapter}/tables/{name}.html" for name in TABLES[chapter]}
    return [in_report(path, f"{chapter}_{name}", heading(chapter), "Tables") for name, path in pages.items()]


def table_sheets(chapter):
    return [f"{RESULTS}/{chapter}/tables/{name}.csv" for name in TABLES[chapter]]


def table_files():
    return [path for chapter in CHAPTERS for path in [*table_sheets(chapter), *table_pages(chapter)]]


# pages over all chapters need all of them
PAGES = {f"chapter_{n}" for n in range(2, 7)} <= set(CHAPTERS)


def scoreboard_files():
    pages = ["scoreboard", "errata", "rigs/comparison"] if PAGES else ["scoreboard"]
    found = [f"{RESULTS}/{page}.{kind}" for page in pages for kind in ("csv", "html")]
    return found + [f"{RESULTS}/rigs/comparison.{kind}" for kind in ("png", "svg") if PAGES]


def pictures(group, *kinds, folder=None):
    """The figures of a chapter or another group, in its folder of the results or in another one."""
    folder = folder or f"{RESULTS}/{group}"
    return [f"{folder}/figures/{name}.{kind}" for kind in kinds for name in FIGURES[group]]


def captioned(group, category, folder=None):
    """PNG pictures of a group, each with its caption in the report."""
    named = zip(FIGURES[group], pictures(group, "png", folder=folder), strict=True)
    return [in_report(path, f"{group}_{name}", category, "Figures") for name, path in named]


def figure_files():
    return [path for chapter in CHAPTERS for path in pictures(chapter, "png", "svg")]


def data_files():
    """Every NetCDF file, so that deleted ones are made again."""
    found = [path for item in STUDIES.items() for _, _, files, _ in study_jobs(*item).values() for path in files]
    return found + [
        f"{RESULTS}/{name}/{stage}.nc" for name in REPLAYS for stage in ("records", "spectra", "identification")
    ]


def crack_files():
    if not settings.cracks:
        return []
    return [f"{RESULTS}/cracks/comparison.nc", *pictures("cracks", "png", "svg")]


# stage of the study of transverse cracks -> the function that computes it
CRACK_STAGES = {
    stage: f"rotorstudy.studies.crack_study.{stage}.{stage}"
    for stage in ("limits", "accuracy", "trials", "fronts", "passage", "thesis_method")
}


def crack_study_files():
    if not CRACK_STUDY:
        return []
    base = f"{RESULTS}/{CRACK_STUDY.name}"
    figures = pictures("chapter_7", "png", "svg", folder=base)
    return [*(f"{base}/{stage}.nc" for stage in CRACK_STAGES), *figures]
