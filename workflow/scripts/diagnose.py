from rotorstudy.studies.workflow import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.presentation.diagnosis_files import diagnose_files

    out = Path(snakemake.output.verdict).parent
    print(diagnose_files(list(snakemake.input.records), snakemake.input.rig, out).summary)
