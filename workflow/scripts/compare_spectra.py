from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.model.registry import registry
    from rotorstudy.store import chunk_of, provenance, save
    from rotorstudy.studies.comparison.config import load_comparison
    from rotorstudy.studies.comparison.trials import spectra
    from thesis.compared import load_rotor

    config = load_comparison(snakemake.input.config)
    method = registry().get("spectrum", snakemake.wildcards.method)
    faults = chunk_of(list(config.faults), *snakemake.params.chunk)
    attributes = provenance(config.model_dump(), [method], config.seed)
    for (name, source), path in zip(snakemake.params.sources.items(), snakemake.output, strict=True):
        found = spectra(config, name, load_rotor(config, name, *source), method, faults)
        save(found.assign_attrs(attributes), path)
