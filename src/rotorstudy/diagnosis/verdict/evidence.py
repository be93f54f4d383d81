"""What a verdict rests on: residuals, detection limits, parameters that moved or are not known, other effects."""

from itertools import product

import numpy as np

from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.verdict import result
from rotorstudy.diagnosis.verdict.cause_words import place, readable
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import is_number

SEEN = 0.5  # of the prior standard deviation: an amplitude known no better from the data has no detection limit
POWER = 1.645  # standard deviations above the threshold for a detection probability of 95 %
MOVED = 2.0  # stated standard deviations beyond which a parameter is listed as moved
PARTS = ("real", "imaginary")
TRADED_OFF = 0.95  # correlation above which two parameters can hardly be separated
MOST_EXCLUDED = 4  # other effects
WORSE = 4.0  # mean square (standard deviations) beyond that of the verdict, by which a harmonic excludes: two of them


def unexplained(fitted, spectrum, settings):
    """Harmonics and nodes with a significant residual, the largest share first."""
    square = spectrum.by_harmonic(fitted.residual) ** 2  # (speed, harmonic, sensor), of standard deviations
    total, speeds = square.sum(), len(spectrum.speed)
    found = []
    for (h, n), (s, node) in product(enumerate(spectrum.harmonics), enumerate(spectrum.sensors)):
        part = 2 * square[:, h, s].sum()
        if chi_square_p_value(part, 2 * speeds) * square[0].size < settings.significance:
            share, sigma = part / (2 * total), np.sqrt(part / (2 * speeds))
            found.append(result.Unexplained(harmonic=int(n), node=int(node), share=share, sigma=sigma))
    return sorted(found, key=lambda row: -row.share)


def _parts(term):
    """(parameter, part, unknown) of each real amplitude of a term."""
    parts = [(p, part) for p in term.parameters for part in (PARTS if p.is_complex else ("amplitude",))]
    return [(p, part, unknown) for (p, part), unknown in zip(parts, term.unknowns, strict=True)]


def detection_limits(found):
    """Amplitude of each candidate detected with a probability of 95 %, the most sensitive first."""
    limits = []
    for c, screened in zip(found.candidates, found.screened, strict=True):
        needed = np.sqrt(2 * LEAST_LOG_ODDS + found.prior_odds.even_odds_gain(c)) + POWER
        for (p, part, unknown), one in zip(_parts(c.term), screened.detection, strict=True):
            if one < SEEN * c.prior[unknown.name][1]:
                size = {"amplitude": needed * one, "unit": p.unit, "of_typical": needed * one / unknown.typical}
                size |= {"parameter": p.name, "part": part}
                limits.append(result.DetectionLimit.of(c.effect, c.where, found.model.structure, **size))
    return sorted(limits, key=lambda row: row.of_typical)


def moved_parameters(fitted, prior):
    """Base parameters that a fit moved by more than two of their stated standard deviations."""
    known, units, rows = fitted.by_name, dict(zip(fitted.model.names, fitted.model.units, strict=True)), []
    for name, (mean, given) in prior.items():
        value, std = known[name]
        if abs(moved := (value - mean) / given) > MOVED:
            row = {"stated": mean, "stated_std": given, "value": value, "std": std, "moved_sigma": moved}
            rows.append(result.MovedParameter(name=name, unit=units[name], **row))
    return rows


def identifiability(fitted, prior):
    """Parameters that are dead, known by their prior alone, or traded off against another."""
    std = np.sqrt(np.diag(fitted.covariance))
    seen = np.linalg.norm(fitted.jacobian, axis=0)
    correlation = fitted.covariance / np.outer(std, std)
    names = fitted.names
    return result.Identifiability(
        dead=[n for n, size in zip(names, seen, strict=True) if size == 0],
        known_by_prior_alone=[n for n, s in zip(names, std, strict=True) if n in prior and s > 0.9 * prior[n][1]],
        traded_off=[
            result.Tradeoff(pair=(names[i], names[j]), correlation=correlation[i, j])
            for i, j in zip(*np.triu_indices(len(std), 1), strict=True)
            if abs(correlation[i, j]) > TRADED_OFF
        ],
    )


def separating_measurements(causes, others, structure):
    """Measurements that separate the causes: those that the plugins state for their confounders, else general ones."""
    found = {}
    for a, b in product(causes, others):
        text = registry().confounders(a.effect).get(b.effect, "other speeds, nearer to and beyond resonance")
        if a.effect == b.effect:
            text = "a probe nearer to one of the places, or a speed near a mode that moves them differently"
        pair = [result.Place.of(one.effect, one.where, structure) for one in (a, b)]
        found[text, *map(place, pair)] = result.SeparatingMeasurement(causes=pair, measurement=text)
    return list(found.values())


def not_considered(causes, settings, known):
    """Declared confounders of the causes that are not candidates; known : effects of the rig."""
    effects = registry().plugins["effect"].items()
    not_tried = {name for name, one in effects if name in settings.leave_out or not one.candidate} - known
    alike = dict.fromkeys(name for cause in causes for name in registry().confounders(cause.effect))
    return [name for name in alike if name in not_tried]


def parameter_labels(model, causes):
    """{name: readable name} of the parameters of the extended model: those of causes with their place."""
    labels, of_cause = {}, {id(cause.term): cause for cause in causes}
    for term in model.terms:
        cause, label = of_cause.get(id(term)), f" ({term.label})" if term.label else ""
        for p, part, unknown in _parts(term):
            text = f"relative change of {p.name}" if is_number(p.name) else f"{readable(p.name)}{label}"
            if cause:
                text = place(cause) if p.name == cause.effect else f"{readable(p.name)} of {place(cause)}"
            labels[unknown.name] = f"{text}, {part} part" if part in PARTS else text
    return labels


def excluded(found, best, stated):
    """The Excluded of each effect that is neither in the best Explanation nor stated beside it, the likeliest first."""
    known, rows = {*stated, *(cause.effect for cause in best.causes)}, {}
    for one in sorted(found.explanations, key=odds_of, reverse=True):
        others = [cause for cause in one.causes if cause.effect not in known]
        if len(others) == 1 and len(one.causes) <= len(best.causes):
            rows.setdefault(others[0].effect, _row(found, best, one, others[0]))
    return list(rows.values())[:MOST_EXCLUDED]


def _row(found, best, one, other):
    """The Excluded of one cause of an explanation, with the harmonic at which that fails most."""
    squares = [found.spectrum.by_harmonic(e.fit.residual) ** 2 for e in (one, best)]  # (speed, harmonic, node)
    worse = (squares[0] - squares[1]).mean(axis=0)
    h, s = np.unravel_index(np.argmax(worse), worse.shape)
    there = {"harmonic": found.spectrum.harmonics[h], "node": found.spectrum.sensors[s]}
    there |= {"sigma": np.sqrt(squares[0][:, h, s].mean())}
    excluded_cause = result.Place.of(other.effect, other.where, found.model.structure)
    odds = odds_of(best) - odds_of(one)
    return result.Excluded(cause=excluded_cause, log_odds=odds, **(there if worse[h, s] >= WORSE else {}))
