"""Physical limits on the estimates of a replayed experiment, from the other measurements of the same rig."""

import functools
import re

import numpy as np
import pandas as pd

from rotorstudy.errors import UnidentifiableError
from rotorstudy.inference.linear import check_identifiable
from rotorstudy.measurement.spectrum import components
from rotorstudy.model.model import Model
from rotorstudy.model.rig_items import make_term
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.measured import measured_response_and_jacobian
from rotorstudy.response.stability import eigenvalues
from rotorstudy.units import percent
from thesis.replay import BOTH_DAMPINGS, DAMPINGS

VALUES = ["estimate", "low", "high", "largest_possible"]
CHECKED = ["source", "group", "parameter", *VALUES, "unit", "verdict", "reason"]


@functools.cache
def largest_participation(n):
    """Largest |p_n| of any breathing function 0 <= s(angle) <= 1, whatever its shape and phase.

    p_n = (s_n + s_{n-2}) / 2 is the mean of s * cos(angle) * e^{-j(n-1) angle}, so at most the mean of the positive
    part of cos(angle) * cos((n-1) angle + phase), maximised over the phase.
    """
    angle = (np.arange(4096) + 0.5) * 2 * np.pi / 4096
    phases = np.linspace(0, np.pi, 91)[:, None]
    force = np.cos(angle) * np.cos((n - 1) * angle + phases)
    return max(np.maximum(force, 0).mean(axis=1).max(), np.maximum(-force, 0).mean(axis=1).max())


def limits(config):
    """Limits by the rotor data and the impact tests, SI: name -> value.

    A free vibration with damping ratio zeta has sqrt(1 - zeta^2) of the undamped frequency, which is known to a few
    per cent (`undamped_frequency_uncertainty`: shaft mass, elasticity); so its measured frequency bounds zeta, that of
    both dampings together. The ratio of the frequencies with the crack open and closed bounds the stiffness loss.
    """
    model = config.model
    node = model.measured[0]
    stiffness = 1 / np.linalg.inv(model.structure.stiffness)[node, node]
    natural = np.abs(eigenvalues(Model(model.structure, ()), [1e-3]).imag).min()
    half = config.frequency_resolution_Hz
    closed, opened = max(config.natural_frequency_Hz.values()), min(config.natural_frequency_Hz.values())
    critical = 2 * stiffness / natural
    highest = natural * (1 + config.undamped_frequency_uncertainty)
    ratio = np.sqrt(max(0.0, 1 - (2 * np.pi * (closed - half) / highest) ** 2))
    loss = stiffness * (1 - ((opened - half) / (closed + half)) ** 2)
    found = {"critical damping": critical, "damping ratio": ratio, "damping": ratio * critical}
    return {**found, "stiffness": stiffness, "stiffness loss": loss}


def shown_name(parameter):
    """A parameter as pages name it: stiffness_loss_22_p-1 -> dk p_-1, eccentricity_phase -> eccentricity phase."""
    name = re.sub("stiffness_loss.*_p", "dk p_", parameter)
    return re.sub("_(phase|dampings?)$", r" \1", name)


def shown_estimates(config, estimates):
    """DataFrame of parameter and values of it (SI, all other numbers) as pages show it: names, units, µm, degrees."""
    reported = config.model.reported_units
    units = {name: reported([name])[0] for name in estimates.parameter if name != BOTH_DAMPINGS}
    units[BOTH_DAMPINGS] = "N s/m"
    shown = {"m": ("µm", 1e6), "rad": ("deg", 180 / np.pi)}
    unit, factor = zip(*(shown.get(units[name], (units[name], 1.0)) for name in estimates.parameter), strict=True)
    values = {key: estimates[key] * np.array(factor) for key in VALUES if key in estimates}
    found = estimates.assign(**values, parameter=estimates.parameter.map(shown_name))
    found.insert(list(found.columns).index("parameter") + 1, "unit", unit)
    return found


def limit_of_estimates(config, bow):
    """Reported parameter -> largest possible size, SI, verdict beyond it, and reason; bow : m, 1X of the slow roll."""
    bound, frequencies = limits(config), config.natural_frequency_Hz.values()
    damping = (
        f"critical damping is {bound['critical damping']:.0f} N s/m; a free vibration at {max(frequencies):g} Hz, with "
        f"the undamped frequency known to {percent(config.undamped_frequency_uncertainty)}, allows a damping ratio of "
        f"at most {bound['damping ratio']:.2f} for both dampings together"
    )
    eccentricity = (
        f"the shaft is bowed by {bow * 1e6:.0f} µm and carries the disc with it; an eccentricity beyond the bow would "
        "need a disc whose own mass centre is off by more than that"
    )
    loss = (
        f"the stiffness loss is at most {bound['stiffness loss']:.0f} N/m by the impact tests ({max(frequencies):g} "
        f"and {min(frequencies):g} Hz, each within {config.frequency_resolution_Hz:g} Hz), times the largest p_n of "
        "any breathing function"
    )
    found = dict.fromkeys((*DAMPINGS, BOTH_DAMPINGS), (bound["damping"], "impossible", damping))
    found["eccentricity"] = bow, "implausible", eccentricity
    for n, name in config.losses.items():
        found[name] = bound["stiffness loss"] * largest_participation(n), "impossible", loss
    return found


def physical_checks(config, estimates, bow):
    """A DataFrame of the estimates (of a DataFrame, SI), each with its limit, a verdict and the reason; bow : m, of 1X.

    It is "impossible" (or "implausible", where the limit is a matter of judgement) if the whole interval lies outside
    the limits, "possible" if it lies inside, else "undecided". dk p_n is judged by size, against the largest stiffness
    loss times the largest p_n of any breathing function; weight dominance is assumed, as in the thesis.
    """
    known, judged_by_size, rows = limit_of_estimates(config, bow), set(config.losses.values()), []
    for row in estimates[estimates.parameter.isin(known)].itertuples():
        (highest, beyond, reason), low, high = known[row.parameter], row.low, row.high
        if row.parameter in judged_by_size:
            ends = sorted((abs(row.low), abs(row.high)))
            low, high = (0.0 if row.low * row.high < 0 else ends[0]), ends[1]
        verdict = "undecided"
        if low >= 0 and high <= highest:
            verdict = "possible"
        elif low > highest or high < 0:
            verdict = beyond
        rows.append((row.source, row.group, row.parameter, row.estimate, row.low, row.high, highest, verdict, reason))
    names = [name for name in CHECKED if name != "unit"]
    return shown_estimates(config, pd.DataFrame(rows, columns=names))[CHECKED]


def _bow(config):
    return make_term("effect", {"kind": "bow", "bow_m": 1.0}, config.model.structure, config.model.sensors)


def bow_magnification(config, compensated):
    """Change of 1X from slow roll (higher case,) of a spectrum (case, harmonic), that of a bowed shaft, m, its share.

    A bow r_0 responds by r_0 k / (k - m w^2); subtracting the slow roll leaves r_0 m w^2 / (k - m w^2), the response
    to an unbalance of eccentricity r_0.
    """
    model = Model(config.model.structure, (_bow(config),), config.model.sensors)
    unit = harmonic_response(model, config.speeds, [1])[:, 0, model.measured[0]]
    first = compensated[:, config.harmonics.index(1)]
    still = first[config.slow]
    change, magnified = first[config.higher] - still, still * (unit[config.higher] / unit[config.slow] - 1)
    return change, magnified, 1 - np.abs(change - magnified) / np.abs(change)


def bow_confounders(config):
    """Why a bow and a free crack force at 1X cannot be told apart, in words; an empty string if they can."""
    model = config.model.plus(_bow(config))
    _, change = measured_response_and_jacobian(model, config.speeds, config.harmonics, model.typical)
    columns = np.stack([components(change[..., p]).ravel() for p in range(len(model.names))], axis=-1)
    try:
        check_identifiable(columns, model.names)
    except UnidentifiableError as error:
        return str(error)
    return ""


def slow_roll_share(config, compensated):
    """Share (higher case, harmonic) of a spectrum present at slow roll: 1 - |change| / |measured|, of vectors."""
    still, moving = compensated[config.slow], compensated[config.higher]
    return 1 - np.abs(moving - still) / np.abs(moving)


def largest_crack_response(config, n):
    """Largest |R_n|, m, that weight can cause at low speed by a crack within the limits of the impact tests."""
    bound, model = limits(config), config.model
    static = np.abs(model.structure.static_deflection[model.measured[0]])
    return bound["stiffness loss"] * largest_participation(n) * static / bound["stiffness"]


def refused_text(checks):
    """Number of impossible or implausible estimates of each source, in words."""
    bad = checks[checks.verdict.isin(["impossible", "implausible"])].source.value_counts()
    counts = checks.source.value_counts(sort=False)
    return "; ".join(f"{source}, {bad.get(source, 0)} of {n}" for source, n in counts.items())


def bow_text(config, compensated):
    """Predicted effect of a bow of the slow roll's size on 1X beside the measured one, in words."""
    change, magnified, share = bow_magnification(config, compensated)
    at = zip(config.higher_cases, magnified, strict=True)
    expected = ", ".join(f"{abs(size) * 1e6:.0f} µm at {name}" for name, size in at)
    measured = ", ".join(f"{abs(c) * 1e6:.0f} µm" for c in change)
    text = f"A bow of the slow roll's size would change 1X by {expected}; the measured change is {measured}"
    if share.min() > 0:
        text += f", of which the bow explains {percent(share.min())} to {percent(share.max())} as vectors"
    if share.min() > 0.5:
        return f"{text}. This is why the estimated eccentricity is close to the bow."
    return (
        f"{text}: 1X of the slow roll is not a bow alone. Part of it is runout, which does not resonate, or an "
        "unbalance opposes the bow."
    )


def slow_roll_text(n, share):
    """Share of a harmonic already present at slow roll, in words; share : (higher case,)"""
    if share.min() < 0:
        return f"{n}X changes from slow roll by more than its own size"
    return f"{percent(share.min())} to {percent(share.max())} of {n}X, as vectors, is already present at slow roll"


def weight_text(config, compensated):
    """Whether weight dominance, which every estimate assumes, can hold, in words."""
    model, change = config.model, bow_magnification(config, compensated)[0]
    static = model.structure.static_deflection[model.measured[0]].real
    ratio = np.abs(change).max() / static
    verdict = "does not hold here" if ratio > 0.5 else "is doubtful"
    return (
        f"Weight dominance, which all estimates assume, {verdict}: 1X without slow roll reaches {percent(ratio)} of "
        f"the static deflection ({np.abs(change).max() * 1e6:.0f} of {static * 1e6:.0f} µm)."
    )
