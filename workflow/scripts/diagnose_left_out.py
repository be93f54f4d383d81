from rotorstudy.studies.workflow import job

with job(snakemake):
    import json

    from rotorstudy.store import write_text
    from thesis.left_out import leave_one_out

    rows = leave_one_out(list(snakemake.input.records), snakemake.input.rig)
    write_text(snakemake.output[0], json.dumps(rows, indent=1, ensure_ascii=False) + "\n")
