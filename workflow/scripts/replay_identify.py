from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.model.registry import registry
    from rotorstudy.model.rig import named_plugins
    from rotorstudy.store import load, provenance, save
    from rotorstudy.thesis.replay import identify, load_replay

    config = load_replay(snakemake.input.config)
    result = identify(config, Path(snakemake.input.published).parent, load(snakemake.input.spectra))
    used = named_plugins(config.rig) + [registry().get("estimator", name) for name in config.estimators]
    save(result.assign_attrs(provenance(config.model_dump(), used, config.seed)), snakemake.output[0])
