from rotorstudy.job import job

with job(snakemake):
    from rotorstudy.plugins import registry
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.compare import load_comparison, load_rotor, spectra

    config, name = load_comparison(snakemake.input.config), snakemake.params.rotor
    rotor = load_rotor(config, name, snakemake.input.source, snakemake.input.get("identification"))
    method = registry().get("spectrum", snakemake.wildcards.method)
    result = spectra(config, name, rotor, method)
    save(result.assign_attrs(provenance(config.model_dump(), [method], config.seed)), snakemake.output[0])
