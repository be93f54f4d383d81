from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.presentation.plots import save_figures
    from rotorstudy.studies.workflow import called, named_function

    config = named_function(snakemake.params.load)(snakemake.input.config)
    save_figures(called(snakemake, config), [*snakemake.output.png, *snakemake.output.svg])
