from rotorstudy.studies.workflow import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.model.registry import registry
    from rotorstudy.store import load, provenance, save
    from rotorstudy.studies.comparison.config import load_comparison
    from rotorstudy.studies.comparison.estimates import bias, estimates
    from rotorstudy.studies.config import file_name, load_study
    from thesis.compared import load_rotor

    config = load_comparison(snakemake.input.config)
    estimator = registry().get("estimator", snakemake.wildcards.estimator)
    attributes = provenance(config.model_dump(), [estimator], config.seed)
    paths = {Path(path).parent.name: path for path in snakemake.output.bias}
    for (name, source), path in zip(snakemake.params.sources.items(), snakemake.output.estimates, strict=True):
        rotor = load_rotor(config, name, *source)
        spectra = [p for p in snakemake.input.spectra if Path(p).parent.name == file_name(name)]
        by_method = {Path(p).stem: load(p) for p in spectra}
        save(estimates(config, name, rotor, by_method, estimator).assign_attrs(attributes), path)
        if file_name(name) in paths:
            found = bias(load_study(source[0]), rotor, estimator)
            save(found.assign_attrs(attributes), paths[file_name(name)])
