from rotorstudy.studies.job import job

with job(snakemake):
    from rotorstudy.store import load, save
    from rotorstudy.studies.config import load_study, study_provenance
    from rotorstudy.studies.simulate import spectra

    config = load_study(snakemake.input.config)
    save(spectra(config, load(snakemake.input.records)).assign_attrs(study_provenance(config)), snakemake.output[0])
