from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.presentation.plots import save_figures
    from rotorstudy.studies.workflow import named_function, opened

    config = named_function(snakemake.params.load)(snakemake.input.config)
    figures = named_function(snakemake.params.function)(config, **snakemake.params.given, **opened(snakemake.input))
    save_figures(figures, [*snakemake.output.png, *snakemake.output.svg])
