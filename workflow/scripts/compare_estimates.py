from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.plugins import registry
    from rotorstudy.store import load, provenance, save
    from rotorstudy.studies.compare import estimates, load_comparison, load_rotor

    config, name = load_comparison(snakemake.input.config), snakemake.params.rotor
    rotor = load_rotor(config, name, snakemake.input.source, snakemake.input.get("identification"))
    estimator = registry().get("estimator", snakemake.wildcards.estimator)
    by_method = {Path(path).stem: load(path) for path in snakemake.input.spectra}
    result = estimates(config, name, rotor, by_method, estimator)
    save(result.assign_attrs(provenance(config.model_dump(), [estimator], config.seed)), snakemake.output[0])
