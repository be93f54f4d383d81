from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.common import study_provenance
    from rotorstudy.studies.config import load_study
    from rotorstudy.studies.workflow import named_function, opened

    config = load_study(snakemake.input.config)
    asked = {name: value for name, value in snakemake.wildcards.items() if name != "study"}
    made = named_function(snakemake.params.function)(config, **asked, **opened(snakemake.input))
    save(made.assign_attrs(study_provenance(config)), snakemake.output[0])
