from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from rotorstudy.presentation.plugin_library_page import write_plugin_library

    write_plugin_library(snakemake.output.html, snakemake.output.csv, index_page(snakemake))
