# Configuration, checked before anything runs, and what every rule shares.
import os
import sys
from pathlib import Path

# one BLAS thread a job: jobs share the cores, and sums are added in the same order on any machine load
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
os.environ["MPLBACKEND"] = "Agg"

ROOT = Path(workflow.basedir)
folders = [str(ROOT / folder) for folder in config.get("plugin_folders", [])]
if folders:
    os.environ["ROTORSTUDY_PLUGINS"] = os.pathsep.join(folders)

try:
    from rotorstudy.errors import RotorstudyError
    from rotorstudy.job import imported_files, plugin_files
    from rotorstudy.studies.config import file_name, load_study
    from rotorstudy.studies.replay import load_replay
    from rotorstudy.studies.workflow import WorkflowConfig
    from rotorstudy.rig import check_config
except ImportError as error:
    sys.exit(f"error: {error}; activate the environment that `make` made (. .venv/bin/activate), or run `make`")

try:
    settings = check_config(WorkflowConfig, dict(config), "the workflow configuration")
    STUDIES = {name: load_study(ROOT / path) for name, path in settings.studies.items()}
    REPLAYS = {name: load_replay(ROOT / path) for name, path in settings.replays.items()}
    for study in STUDIES.values():
        study.check_rigs()
    for replay in REPLAYS.values():
        replay.model
except RotorstudyError as error:
    sys.exit(f"error: {error}")

RESULTS = settings.results
REFERENCE = str(ROOT / settings.reference)


wildcard_constraints:
    study="|".join(STUDIES) or "none",
    replay="|".join(REPLAYS) or "none",
    rig="[^/]+",
    case="[^/]+",


def code(script):
    """Modules of rotorstudy a script imports: Snakemake does not see them by itself."""
    return imported_files(ROOT / "workflow" / "scripts" / script)


def study_plugins(*kinds):
    return lambda wildcards: plugin_files(list(STUDIES[wildcards.study].rigs.values()), *kinds)


def study_config(wildcards):
    return str(ROOT / settings.studies[wildcards.study])


def replay_config(wildcards):
    return str(ROOT / settings.replays[wildcards.replay])


def in_report(path, caption, category, subcategory):
    """A file shown in the HTML report, with its caption from workflow/report."""
    name = Path(path).stem.replace("_", " ")
    return report(
        path,
        caption=f"../report/{caption}.rst",
        category=category,
        subcategory=subcategory,
        labels={"what": name},
    )


def heading(chapter):
    return chapter.replace("_", " ").capitalize()
