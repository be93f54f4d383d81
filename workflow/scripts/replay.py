from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.model.registry import registry
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.workflow import named_function, opened
    from rotorstudy.thesis.config import load_replay

    config = load_replay(snakemake.input.config)
    made = named_function(snakemake.params.function)(config, **snakemake.params.given, **opened(snakemake.input))
    used = [plugin for _, plugin in registry() if plugin.file in snakemake.input.get("plugins", [])]
    save(made.assign_attrs(provenance(config.model_dump(), used)), snakemake.output[0])
