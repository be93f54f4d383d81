from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.presentation.index_page import write_index

    write_index(snakemake.output.page, [*snakemake.input], snakemake.output.report)
