from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.store import provenance, save
    from rotorstudy.thesis.replay import load_replay, records

    config = load_replay(snakemake.input.config)
    result = records(config, Path(snakemake.input.published).parent)
    save(result.assign_attrs(provenance(config.model_dump())), snakemake.output[0])
