from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from rotorstudy.presentation.tables import write_csv, write_tables
    from rotorstudy.studies.workflow import called, named_function

    config = named_function(snakemake.params.load)(snakemake.input.config)
    scored, tables = called(snakemake, config, reasons=snakemake.input.reasons)
    write_csv(scored, snakemake.output.scored)
    write_tables(tables, [*snakemake.output.csv, *snakemake.output.html], index_page(snakemake))
