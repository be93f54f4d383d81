from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.model.registry import registry
    from rotorstudy.store import load, provenance, save
    from rotorstudy.thesis.replay import load_replay, spectra

    config = load_replay(snakemake.input.config)
    result = spectra(config, load(snakemake.input.records))
    used = [registry().get("spectrum", name) for name in config.spectra]
    save(result.assign_attrs(provenance(config.model_dump(), used)), snakemake.output[0])
