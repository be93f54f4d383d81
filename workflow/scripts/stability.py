from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.stability import stability

    config = load_study(snakemake.input.config)
    save(stability(config, config.main_rig).assign_attrs(study_provenance(config)), snakemake.output[0])
