from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.presentation.bearing_figures import plot_bearing_coefficients
    from rotorstudy.presentation.plots import save_figure
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.bearings import all_bearings, bearing_coefficients

    plugins = all_bearings()
    data = bearing_coefficients(plugins)
    examples = {plugin.name: plugin.example for plugin in plugins}
    save(data.assign_attrs(provenance(examples, plugins)), snakemake.output.data)
    save_figure(plot_bearing_coefficients(data), snakemake.output.png, snakemake.output.svg)
