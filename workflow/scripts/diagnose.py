from rotorstudy.studies.workflow import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.presentation.diagnosis_report import report

    verdict = report(list(snakemake.input.records), snakemake.input.rig, Path(snakemake.output.verdict).parent)
    print(verdict["summary"])
