from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.whirl import whirl

    config = load_study(snakemake.input.config)
    save(whirl(config).assign_attrs(study_provenance(config)), snakemake.output[0])
