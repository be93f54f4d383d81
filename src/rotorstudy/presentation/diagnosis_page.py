"""The page of a diagnosis: verdict in words, evidence and assumptions."""

from rotorstudy.diagnosis.verdict.cause_words import cause_in_words, place, readable, sizes
from rotorstudy.diagnosis.verdict.steps import known_and_not, next_steps, separated
from rotorstudy.diagnosis.verdict.words import detection_limits, excluded_in_words, smallest_detected
from rotorstudy.presentation.captions import CHANGE_FIGURES, DIAGNOSIS_FIGURES
from rotorstudy.presentation.pages import inline_png, render
from rotorstudy.presentation.speed_view import speed_view
from rotorstudy.presentation.tables import cells
from rotorstudy.units import p_value, percent, probability, quantity, spins

MOST_LIMITS = 12  # detection limits on the page, the lowest first; all are in verdict.json
CHANGED = {
    "nothing": "nothing",
    "cause": "the cause is identified",
    "ambiguous": "more than one cause is possible",
    "unknown": "an unknown cause",
}
HEADINGS = {
    "nothing": "nothing is missing",
    "cause": "a cause is identified",
    "ambiguous": "more than one cause is possible",
    "unknown": "an unknown effect is missing",
}


def diagnosis_page(verdict, data, figures, title, links=None):
    """The page as HTML.

    Parameters
    ----------
    verdict : Verdict
    data : xarray.Dataset
        The content of verdict.nc.
    figures : dict
        Name -> PNG (path or bytes), for each name of `DIAGNOSIS_FIGURES`; in a comparison of two states of
        `CHANGE_FIGURES` too.
    title : str
        What was diagnosed.
    links : dict, optional
        Text -> address of pages to go to from the top.
    """
    import pandas as pd

    labels = dict(zip(data.parameter.values.tolist(), data.label.values.tolist(), strict=True))
    limits = detection_limits(verdict)
    card, of_change = verdict.identifiability, "two_states" in figures
    tables = {
        "unexplained": _unexplained(verdict),
        "moved": _moved(verdict, labels),
        "limits": _limits(limits[:MOST_LIMITS]),
        "settings": [{"setting": key, "value": _setting(value)} for key, value in verdict.settings],
    }
    return render(
        "diagnosis.html",
        title=_title(title, verdict.verdict, of_change),
        links=links or {},
        verdict=verdict,
        glance=_glance(verdict, of_change),
        next_steps=next_steps(verdict, of_change),
        view=speed_view(data),
        alternatives=[_with_probability(cause_in_words(c), c) for c in verdict.ambiguous_with],
        excluded=excluded_in_words(verdict) if verdict.verdict in ("cause", "ambiguous") else [],
        separated=separated(verdict) if verdict.ambiguous_with else {},
        figures={
            name: {"title": heading, "caption": caption, "source": inline_png(figures[name])}
            for name, (heading, caption) in (CHANGE_FIGURES | DIAGNOSIS_FIGURES).items()
            if name in figures
        },
        left=_left(verdict),
        limits_note="The smallest amplitudes that are detected with a probability of 95 %, the lowest "
        f"{min(MOST_LIMITS, len(limits))} of {len(limits)} (all in verdict.json). Anything smaller may go undetected.",
        identifiability={
            "dead": [labels[name] for name in card.dead],
            "known_by_prior_alone": [labels[name] for name in card.known_by_prior_alone],
            "traded_off": [
                f"{' and '.join(labels[name] for name in one.pair)} (correlation {one.correlation:.3f})"
                for one in card.traded_off
            ],
        },
        origin=_origin(verdict, data),
        **{name: cells(pd.DataFrame(rows), 3) for name, rows in tables.items()},
    )


def _title(name, kind, of_change):
    if of_change:
        return f"What changed in {name}: {CHANGED[kind]}"
    return f"Diagnosis of {name}: {HEADINGS[kind]}"


def _with_probability(text, cause):
    return f"{text}; posterior probability {probability(cause.posterior_probability)}"


def _glance(verdict, of_change):
    """The verdict as rows (name, text): cause, place, size, posterior probability, gain; of an unknown one less."""
    rows, gain = [], verdict.gain
    if verdict.verdict == "unknown":
        rows = list(known_and_not(verdict, of_change).items())
    else:
        named = "Cause" if verdict.verdict == "cause" else "Most likely"
        for cause in verdict.causes:
            rows.append((named, _with_probability(place(cause), cause)))
            rows += [(f"its {name}", text) for name, text in sizes(cause).items()]
    if verdict.verdict == "nothing":
        rows.append(("Residual under noise alone", p_value(verdict.residual_p_value.before)))
        detected = "; ".join(smallest_detected(verdict))
        rows.append(("Detected with 95 % probability", detected or "no effect is detectable"))
    if gain is None:
        rows.append(("Gain", "not known; no speed was held out"))
    elif verdict.causes:
        lengths = f"{quantity(gain.before_m, 'm')} to {quantity(gain.after_m, 'm')} rms"
        sigmas = f"{gain.before_sigma:.3g} to {gain.after_sigma:.3g} standard deviations"
        rows.append(("Error at held-out speeds", f"{lengths}, {sigmas}, at {spins(gain.speeds)}"))
    return rows


def _left(verdict):
    added = "With all causes added" if verdict.causes else "Nothing was added"
    return (
        f"{added}: residual {p_value(verdict.residual_p_value.after)}; {percent(verdict.residual_share)} of the excess "
        "error (rms) is left."
    )


def _unexplained(verdict):
    return [
        {
            "harmonic": f"{row.harmonic}X",
            "node": row.node,
            "share of the residual (%)": 100 * row.share,
            "standard deviations": row.sigma,
        }
        for row in verdict.unexplained
    ]


def _moved(verdict, labels):
    return [
        {
            "parameter": labels[row.name],
            "stated": quantity(row.stated, row.unit, row.stated_std),
            "fitted": quantity(row.value, row.unit, row.std),
            "moved (stated standard deviations)": row.moved_sigma,
        }
        for row in verdict.base_parameters
    ]


def _limits(limits):
    return [
        {
            "effect": place(row),
            "parameter": readable(row.parameter),
            "smallest detected": quantity(row.amplitude, row.unit),
            "relative to a typical one": row.of_typical,
        }
        for row in limits
    ]


def _setting(value):
    """A setting as text."""
    if isinstance(value, dict):
        return ", ".join(f"{key}: {one}" for key, one in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return "by default" if value is None else str(value)


def _origin(verdict, data):
    origin = verdict.provenance
    counts = {"speed": len(data.speed), "harmonic": len(data.harmonic), "node": len(data.node)}
    said = ", ".join(f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items())
    made = f"rotorstudy {origin['rotorstudy_version']}, commit {origin['git_commit']}"
    files = f"records: {origin['records']}; rig: {origin['rig']}"
    return f"{said}; {verdict.candidates} candidates. {made}; {files}."
