from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from rotorstudy.presentation.published_page import write_published

    write_published(snakemake.output.html, snakemake.output.csv, snakemake.input.rigs, index_page(snakemake))
