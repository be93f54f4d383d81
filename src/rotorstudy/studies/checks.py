"""Estimates from a replayed experiment set against what physics and the other measurements of the same rig allow."""

import numpy as np

from rotorstudy.identification import check_identifiable
from rotorstudy.rig import make_term
from rotorstudy.spectrum import components
from rotorstudy.store import as_complex


def limits(config):
    """What mass, stiffness and the impact tests allow, each with its derivation.

    The impact tests print natural frequencies to 1 Hz. A free vibration seen at w_d = w_n sqrt(1 - zeta^2) bounds the
    damping; the frequency with the crack open over that with it closed bounds the stiffness loss.
    """
    structure = config.model.structure
    mass, stiffness = structure.mass[0, 0], structure.stiffness[0, 0]
    natural = np.sqrt(stiffness / mass)
    half = config.frequency_resolution_Hz
    closed, opened = max(config.natural_frequency_Hz.values()), min(config.natural_frequency_Hz.values())
    seen = 2 * np.pi * (closed - half)
    ratio = np.sqrt(max(0.0, 1 - (seen / natural) ** 2))
    loss = stiffness * (1 - ((opened - half) / (closed + half)) ** 2)
    return {
        "critical damping": 2 * np.sqrt(stiffness * mass),
        "damping": ratio * 2 * np.sqrt(stiffness * mass),
        "damping ratio": ratio,
        "stiffness loss": loss,
        "stiffness": stiffness,
        "natural frequency": natural,
    }


def physical_checks(config, estimates, slow_roll_bow):
    """A DataFrame: each estimate, what is allowed, a verdict, and why.

    estimates     : DataFrame with source, group, parameter, estimate, low, high, SI
    slow_roll_bow : m, 1X of the slow roll
    verdict       : "impossible" if the whole interval lies outside, "possible" if it lies inside, else "undecided"
    """
    import pandas as pd

    bound = limits(config)
    rows = []

    def judge(row, parameter, scale, unit, allowed, why):
        low, high = sorted((row.low / scale, row.high / scale))
        inside = allowed[0] <= low and high <= allowed[1]
        outside = high < allowed[0] or low > allowed[1]
        verdict = "possible" if inside else "impossible" if outside else "undecided"
        rows.append(
            {
                "source": row.source,
                "group": row.group,
                "parameter": parameter,
                "estimate": row.estimate / scale,
                "low": low,
                "high": high,
                "allowed_low": allowed[0],
                "allowed_high": allowed[1],
                "unit": unit,
                "verdict": verdict,
                "reason": why,
            }
        )

    damping = (
        f"critical damping is {bound['critical damping']:.0f} N s/m; a free vibration seen within "
        f"{config.frequency_resolution_Hz:g} Hz of the undamped frequency allows a damping ratio up to "
        f"{bound['damping ratio']:.3f}"
    )
    bow = (
        f"the shaft is bent by {slow_roll_bow * 1e6:.0f} um and carries the disc with it; an eccentricity larger than "
        "the bow "
        "needs a disc whose own mass centre is off by more than that"
    )
    loss = (
        f"0 for a crack that only weakens, at most {bound['stiffness loss']:.0f} N/m from the impact tests "
        f"({max(config.natural_frequency_Hz.values()):g} and {min(config.natural_frequency_Hz.values()):g} Hz, each "
        "within "
        f"{config.frequency_resolution_Hz:g} Hz); k_0 is {bound['stiffness']:.0f} N/m"
    )
    for row in estimates.itertuples():
        if row.parameter in ("external_damping", "internal_damping"):
            judge(row, row.parameter, 1.0, "N s/m", (0.0, bound["damping"]), damping)
        elif row.parameter == "eccentricity":
            judge(row, row.parameter, 1.0, "m", (0.0, slow_roll_bow), bow)
        elif row.parameter.startswith("stiffness_loss_p"):
            n = int(row.parameter.removeprefix("stiffness_loss_p"))
            judge(
                row, f"stiffness loss from p_{n}", config.participation[n], "N/m", (0.0, bound["stiffness loss"]), loss
            )
    return pd.DataFrame(rows)


def bow_magnification(config, compensated):
    """How much of the change of 1X from slow roll a bent shaft explains by itself.

    A bow r_0 vibrates by r_0 k / (k - m w^2); taking the slow roll off leaves r_0 m w^2 / (k - m w^2), the very
    response of an unbalance of eccentricity r_0.

    compensated : (case, harmonic) complex, m
    returns     : measured and predicted change of 1X, (higher case,) complex
    """
    structure = config.model.structure
    mass, stiffness = structure.mass[0, 0], structure.stiffness[0, 0]
    one, slow = config.harmonics.index(1), list(config.cases).index(config.slow_roll)
    higher = [c for c in range(len(config.cases)) if c != slow]
    bow = compensated[slow, one]
    inertia = mass * config.speeds[higher] ** 2
    return compensated[higher, one] - bow, bow * inertia / (stiffness - inertia)


def bow_twins(config):
    """The message that a bow and a free crack force at 1X cannot be told apart, or an empty string if they can."""
    from rotorstudy.errors import UnidentifiableError
    from rotorstudy.response import measured_response

    bow = make_term("effect", {"kind": "bow"}, config.model.structure, config.model.sensors)
    model = config.model.plus(bow)
    _, change = measured_response(model, config.speeds, config.harmonics, model.typical, jacobian=True)
    columns = np.stack([components(change[..., p]).ravel() for p in range(len(model.names))], axis=-1)
    try:
        check_identifiable(columns, model.names)
    except UnidentifiableError as error:
        return str(error)
    return ""


def slow_roll_bow(config, spectra_data, data_set):
    """Size of the 1X harmonic of the slow roll, m."""
    one = spectra_data.compensated.sel(version="corrected", data_set=data_set, case=config.slow_roll, harmonic=1)
    return float(np.abs(as_complex(one.isel(spectrum_method=0))))
