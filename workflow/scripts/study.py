from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.common import study_provenance
    from rotorstudy.studies.config import load_study
    from rotorstudy.studies.workflow import named_function, opened

    config = load_study(snakemake.input.config)
    attributes, results = study_provenance(config), opened(snakemake.input)
    for path, (function, given) in zip(snakemake.output, snakemake.params.calls, strict=True):
        save(named_function(function)(config, **given, **results).assign_attrs(attributes), path)
