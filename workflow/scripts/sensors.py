from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.sensors import sensors

    config = load_study(snakemake.input.config)
    save(
        sensors(config, config.main_rig).assign_attrs(study_provenance(config, config.monte_carlo.seed)),
        snakemake.output[0],
    )
