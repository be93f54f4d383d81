"""The figures that every simulated chapter has."""

from rotorstudy.presentation import estimate_figures, whirl_figures


def study_figures(config, stages, noisy, cases, titles, closed_form=None, rigs=None):
    """Figures of the stages that the simulated chapters have in common.

    noisy : title of a column -> Monte Carlo Dataset of one record kind;  cases : case -> its name in the figures, for
    bias; weight dominance is shown for the first;  closed_form, rigs : as of `whirl_figures`
    """
    units, (case, shown) = config.reported, next(iter(cases.items()))
    found = {
        "error_against_noise": estimate_figures.error_against_noise(noisy, units, titles["error_against_noise"]),
        "bias": estimate_figures.bias(stages["bias"], cases, units, titles["bias"]),
        "weight_dominance": estimate_figures.weight_dominance(
            config, stages["weight_dominance"], case, shown, units, titles["weight_dominance"]
        ),
        "stability": whirl_figures.stability(stages["stability"], closed_form),
    }
    if "identifiability" in stages:
        first = next(iter(config.cases))
        found["collinearity"] = estimate_figures.collinearity(stages["identifiability"], first, titles["collinearity"])
    if "whirl" in stages:
        found["campbell"] = whirl_figures.campbell(stages["whirl"], rigs, titles["campbell"])
    return found
