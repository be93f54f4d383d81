from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.common import study_provenance
    from rotorstudy.studies.config import load_study
    from rotorstudy.studies.workflow import called

    config = load_study(snakemake.input.config)
    save(called(snakemake, config).assign_attrs(study_provenance(config)), snakemake.output[0])
