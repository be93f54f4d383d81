from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.presentation.diagnosis_files import diagnose_files
    from rotorstudy.presentation.pages import to_index

    out = Path(snakemake.output.verdict).parent
    given, name = snakemake.input, snakemake.wildcards.diagnosis.replace("_", " ")
    links = to_index(snakemake.output.page, index_page(snakemake))
    print(diagnose_files(list(given.records), given.rig, out, name=name, links=links).summary)
