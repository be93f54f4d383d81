# rotorstudy: rebuild every figure and table of the studies. `make`, or `snakemake --cores all`.
from snakemake.utils import min_version

min_version("9.0")


configfile: "workflow/config/config.yaml"


# only used if asked for (--software-deployment-method apptainer)
container: "docker://python:3.11"


include: "workflow/rules/common.smk"
include: "workflow/rules/shared.smk"
include: "workflow/rules/study.smk"
include: "workflow/rules/replay.smk"
include: "workflow/rules/zoo.smk"
include: "workflow/rules/compare.smk"
include: "workflow/rules/bearings.smk"
include: "workflow/rules/blind.smk"
include: "workflow/rules/diagnose.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/cracks.smk"
include: "workflow/rules/chapter_7.smk"


# what was found, written by the rule index
report: str(Path(f"{RESULTS}/report.rst").resolve())


rule index:
    input:
        all_files(),
    output:
        page=f"{RESULTS}/index.html",
        report=f"{RESULTS}/report.rst",
    params:
        code=code("index.py"),
    log:
        f"{RESULTS}/logs/index.log",
    run:
        run_script("index.py", input, output, params, wildcards, threads, log)


rule all:
    default_target: True
    input:
        all_files(),
        rules.index.output,
