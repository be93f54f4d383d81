from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.presentation.tables import write_csv, write_tables
    from rotorstudy.studies.workflow import named_function, opened

    config = named_function(snakemake.params.load)(snakemake.input.config)
    given = {**snakemake.params.given, **opened(snakemake.input), "reasons": snakemake.input.reasons}
    scored, tables = named_function(snakemake.params.function)(config, **given)
    write_csv(scored, snakemake.output.scored)
    write_tables(tables, [*snakemake.output.csv, *snakemake.output.html])
