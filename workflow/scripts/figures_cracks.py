from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.presentation.plots import save_figure
    from rotorstudy.store import load
    from rotorstudy.studies import cracks

    config, data = cracks.load_cracks(snakemake.input.config), load(snakemake.input.comparison)
    pictures = (
        cracks.stiffness_figure(data),
        cracks.spectra_figure(data),
        cracks.sweep_figure(data, config.shown_orders),
        cracks.depth_figure(data, config.shaft),
    )
    for picture, png, svg in zip(pictures, snakemake.output.png, snakemake.output.svg, strict=True):
        save_figure(picture, png, svg)
