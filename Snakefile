# rotorstudy: rebuild every figure and table of the studies. `make`, or `snakemake --cores all`.
# The jobs and their files are in workflow/jobs/plan.py; each becomes a rule here.
import os
import sys
from pathlib import Path

from snakemake.utils import min_version

min_version("9.0")


configfile: "workflow/config/config.yaml"


# only used if asked for (--software-deployment-method apptainer)
container: "docker://python:3.11"


ROOT = Path(workflow.basedir)
# the packages `jobs` and `thesis`, for these rules and for jobs, which are processes of their own
sys.path.insert(0, str(ROOT / "workflow"))
os.environ.update(PYTHONPATH=os.pathsep.join(filter(None, [sys.path[0], os.environ.get("PYTHONPATH")])))
# one BLAS thread per job: jobs share the cores, and the order of summation does not depend on the load
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", MPLBACKEND="Agg")
if config.get("plugin_folders"):
    os.environ.update(ROTORSTUDY_PLUGINS=os.pathsep.join(str(ROOT / folder) for folder in config["plugin_folders"]))

try:
    from jobs.plan import Plan
    from jobs.report import reported
    from jobs.run import code_digest, run_job
    from jobs.settings import read_settings
except ImportError as error:
    sys.exit(f"error: {error}; activate the environment that `make` made (. .venv/bin/activate), or run `make`")

SETTINGS = read_settings(config)
RESULTS = SETTINGS.config.results
BASES = SETTINGS.bases
JOBS = {job.name: job for job in Plan(SETTINGS).jobs()}


# what was found, written by the job `index`
report: str(Path(f"{RESULTS}/report.rst").resolve())


for job in JOBS.values():

    rule:
        name:
            job.name
        input:
            *job.needs,
            **job.inputs,
        output:
            *reported(job.makes, RESULTS),
            **{name: reported(files, RESULTS) for name, files in job.outputs.items()},
        params:
            # of what Snakemake does not track; not inputs, as it would look up a hundred files before each job
            code=code_digest(*job.functions, files=BASES),
            given=job.given,
        priority: job.priority
        threads: job.threads
        log:
            f"{RESULTS}/logs/{job.log}.log",
        run:
            run_job(JOBS[rule], input, output, wildcards, threads, log)


rule all:
    default_target: True
    input:
        [path for job in JOBS.values() for path in job.files if "{" not in path],
