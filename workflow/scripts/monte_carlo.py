from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.identify import monte_carlo

    config = load_study(snakemake.input.config)
    result = monte_carlo(config, snakemake.wildcards.rig, config.case_of(snakemake.wildcards.case))
    save(result.assign_attrs(study_provenance(config, seed=config.monte_carlo.seed)), snakemake.output[0])
