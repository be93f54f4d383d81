from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.model.registry import registry
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.workflow import called
    from thesis.config import load_replay

    config = load_replay(snakemake.input.config)
    used = [plugin for _, plugin in registry() if plugin.file in snakemake.input.get("plugins", [])]
    save(called(snakemake, config).assign_attrs(provenance(config.model_dump(), used)), snakemake.output[0])
