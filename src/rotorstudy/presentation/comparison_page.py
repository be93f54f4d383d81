"""Results of the comparison of spectrum methods and estimators: figures, ranking and recommendation."""

from pathlib import Path

from rotorstudy.presentation.comparison_figures import comparison_figures
from rotorstudy.presentation.pages import to_index
from rotorstudy.presentation.plots import save_figures
from rotorstudy.presentation.tables import write_csv, write_html
from rotorstudy.store import gathered, load, provenance, save
from rotorstudy.studies.comparison import estimates as accuracy
from rotorstudy.studies.comparison import ranking
from rotorstudy.studies.comparison.config import load_comparison
from rotorstudy.studies.config import file_name


def write_comparison(comparison, pictures, ranking_csv, advice_files, config, spectra, estimates, bias, index):
    """Write the comparison as NetCDF, its figures and its tables from the files "<rotor>/<method or estimator>.nc"."""
    config = load_comparison(config)
    names = {file_name(name): name for name in config.rotors}

    def loaded(paths):
        """(rotor, method) -> Dataset of all chunks."""
        found = {}
        for path in map(Path, paths):
            found.setdefault((names[path.parent.name], path.stem), []).append(load(path))
        return {key: gathered(parts, "fault") if len(parts) > 1 else parts[0] for key, parts in found.items()}

    whole = accuracy.comparison(loaded(estimates))
    save(whole.assign_attrs(provenance(config.model_dump(), [], config.seed), title=config.title), comparison)
    ranked = ranking.ranking(whole)
    write_csv(ranked, ranking_csv)
    write_advice(ranked, {name: fault.use_if for name, fault in config.faults.items()}, *advice_files, index)
    errors = {key: data.harmonic_error for key, data in loaded(spectra).items()}
    biased = [(*key, data) for key, data in loaded(bias).items()]
    save_figures(comparison_figures(whole, errors, biased, config.trials), pictures)


def write_advice(ranked, use_if, csv, html, index=None):
    """Write which spectrum method and estimator to use for which fault; use_if : fault -> when to follow it."""
    told = ranking.with_words(ranking.advice(ranked), use_if)
    write_csv(told, csv)
    choices = ranking.in_sentences(told)
    first = choices.drop_duplicates(ranking.FIRST).drop(columns="equally good")
    lowest, highest = (f"{100 * share:.0f}" for share in ranking.VALID)
    write_html(
        html,
        "Which spectrum method and estimator for which data",
        [
            "The first choice for each fault of a record, and where you do not know. The error is that of the "
            "parameters on all rotors, over the Cramér-Rao bound: the least error that the noise allows.",
            "Choices are the spectrum methods with the smallest error in their worst rotor and noise level, at most "
            "three, each with the estimator to use and those whose error is within "
            f"{100 * (ranking.AS_GOOD - 1):.0f} % of it. Pairs that fail in more than {100 * ranking.SELDOM:.0f} % of "
            "the trials are left out.",
            f"Intervals are valid if in every cell between {lowest} and {highest} % of the stated 95 % intervals "
            "hold the truth.",
            "advice.csv also has coverage, failures and times, ranking.csv every pair on every rotor.",
        ],
        {"First choice": first, "Up to three choices": choices},
        3,
        links=to_index(html, index),
    )
