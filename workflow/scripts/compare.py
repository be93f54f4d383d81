from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.presentation.comparison_figures import comparison_figures
    from rotorstudy.presentation.comparison_page import write_advice, write_ranking
    from rotorstudy.presentation.plots import save_figures
    from rotorstudy.store import gathered, load, provenance, save
    from rotorstudy.studies.comparison.config import load_comparison
    from rotorstudy.studies.comparison.estimates import comparison
    from rotorstudy.studies.comparison.ranking import ranking
    from rotorstudy.studies.config import file_name

    config, output = load_comparison(snakemake.input.config), snakemake.output
    names = {file_name(name): name for name in config.rotors}

    def loaded(paths):
        """(rotor, method) -> Dataset of all chunks, whose files are in the order of the faults."""
        found = {}
        for path in map(Path, paths):
            found.setdefault((names[path.parent.name], path.stem), []).append(load(path))
        return {key: gathered(parts, "fault") if len(parts) > 1 else parts[0] for key, parts in found.items()}

    whole = comparison(loaded(snakemake.input.estimates))
    save(whole.assign_attrs(provenance(config.model_dump(), [], config.seed), title=config.title), output.comparison)
    ranked = ranking(whole)
    index = index_page(snakemake)
    write_ranking(ranked, config.trials, output.ranking, output.ranking_page, index)
    use_if = {name: fault.use_if for name, fault in config.faults.items()}
    write_advice(ranked, use_if, output.advice, output.advice_page, index)
    errors = {key: data.harmonic_error for key, data in loaded(snakemake.input.spectra).items()}
    biased = [(*key, data) for key, data in loaded(snakemake.input.bias).items()]
    save_figures(comparison_figures(whole, errors, biased, config.trials), [*output.png, *output.svg])
