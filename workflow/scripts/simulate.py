from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.simulate import simulate

    config = load_study(snakemake.input.config)
    save(simulate(config, snakemake.wildcards.rig).assign_attrs(study_provenance(config)), snakemake.output[0])
