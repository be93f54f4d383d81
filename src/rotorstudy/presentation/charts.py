"""Charts that a reader zooms and reads values from, as plain data for `templates/charts.js`, in the reader's units.

Drawn by uPlot, which adds 53 kB to a page; the smallest bundle of Plotly has 1.1 MB, that of Bokeh 1.3 MB.
"""

import json

import numpy as np

from rotorstudy.presentation.bode_figures import LABELLED, marked
from rotorstudy.presentation.plots import phase_lag
from rotorstudy.units import shown_amplitude, shown_speed, shown_unit, spin

MOST_SPEEDS = 120  # of a run-up, evenly spaced
MOST_POINTS = 400  # of a curve
DIGITS = 4  # significant ones, as a picture shows no more


def bode_charts(name, speed, curves, points=None, lines=(), bands=(), points_speed=None):
    """Bode plots of each node, side by side with the polar plot.

    Parameters
    ----------
    name : str
        Of the place on the page.
    speed : array (speed,)
        rad/s.
    curves : dict
        Node -> {probe: (speed,) complex, m}.
    points : dict, optional
        The same, measured, at `points_speed`.
    lines : sequence of rad/s
        Marks along the axis of speed.
    bands : sequence of (rad/s, rad/s)
        Ranges of speed, shaded.
    """
    (unit, factor), (speed_unit, per) = shown_amplitude(), shown_speed()
    across = {"label": "speed", "unit": speed_unit}
    marks = {"lines": [{"x": w * per} for w in lines], "bands": [[a * per, b * per] for a, b in bands]}
    views = []
    for node, probes in curves.items():
        size, lag, vector = [], [], []
        for i, (probe, one) in enumerate(probes.items()):
            found = [(speed, one, {"label": probe, "line": True})]
            if points:
                found.append(
                    (
                        points_speed,
                        points[node][probe],
                        {"label": f"{probe} measured", "mark": "circle", "hollow": True},
                    )
                )
            for at, values, style in found:
                kept = _thinned(len(at), MOST_POINTS)
                x, values = rounded(at[kept] * per, 6), values[kept]
                given = {"colour": i % 6, **style}
                phase = phase_lag(values)
                size.append({**given, "x": x, "y": rounded(factor * np.abs(values))})
                lag.append({**given, "x": x, "y": rounded(phase)})
                texts = {str(k): f"{x[k]:.0f}" for k in marked(values, LABELLED)} if style.get("line") else {}
                shown = factor * values.conj()  # the lag counter-clockwise
                vector.append({**given, "x": rounded(shown.real), "y": rounded(shown.imag), "speed": x, "texts": texts})
        top = {
            "title": f"Amplitude, node {node}",
            "group": name,
            "hover": "x",
            "x": across,
            "y": {"label": "1X", "unit": unit},
            "series": size,
            **marks,
        }
        low = {
            "title": f"Phase, node {node}",
            "group": name,
            "hover": "x",
            "x": across,
            "y": {"label": "lag from the mark", "unit": "°"},
            "series": lag,
            **marks,
        }
        polar = {
            "title": f"Polar plot, node {node}",
            "hover": "near",
            "speed": speed_unit,
            "equal": True,
            "x": {"label": "in phase with the mark", "unit": unit},
            "y": {"label": "lagging by 90°", "unit": unit},
            "series": vector,
        }
        views.append({"name": f"node {node}", "charts": [top, low, polar]})
    return {"name": name, "height": 280, "views": views}


def campbell_chart(data, kinds, criticals, operating=None):
    """The Campbell diagram of an analysis; kinds : [(label, (speed, mode) bool)]."""
    unit, per = shown_speed()
    speed, frequency = data.speed.values, data.frequency.values / (2 * np.pi)
    every = np.broadcast_to(speed[:, None], frequency.shape)
    series = []
    for i, (label, chosen) in enumerate(kinds):
        if chosen.any():
            x, y = every[chosen], frequency[chosen]
            seen = y < 2.5 * speed[-1] / (2 * np.pi)
            series.append(
                {
                    "label": label,
                    "colour": (0, 4, 1)[i],
                    "mark": "circle",
                    "size": 1.6,
                    "x": rounded(x[seen] * per),
                    "y": rounded(y[seen]),
                }
            )
    ends = np.array([speed[0], speed[-1]])
    series.append(
        {
            "label": "1X",
            "colour": 6,
            "line": True,
            "dash": [2, 3],
            "x": rounded(ends * per),
            "y": rounded(ends / (2 * np.pi)),
        }
    )
    at = np.array([one.speed for one in criticals])
    if len(at):
        told = [f"{spin(w)}, damping ratio {one.damping_ratio:.3g}" for w, one in zip(at, criticals, strict=True)]
        series.append(
            {
                "label": "critical speed",
                "colour": 6,
                "mark": "circle",
                "hollow": True,
                "size": 5,
                "x": rounded(at * per),
                "y": rounded(at / (2 * np.pi)),
                "text": told,
            }
        )
    chart = {
        "title": "Campbell diagram",
        "hover": "near",
        "x": {"label": "speed", "unit": unit},
        "y": {"label": "whirl frequency", "unit": "Hz"},
        "series": series,
        "bands": [[w * per for w in operating]] if operating else [],
    }
    return {"name": "campbell", "height": 320, "views": [{"name": "", "charts": [chart]}]}


def speed_view(name, speed, node, harmonic, spectra, std, start=(0, 0), axes=None, told=None, sigma=(), signals=None):
    """Orbit, waveform, full spectrum and residual at the speed and node that a reader chooses.

    Parameters
    ----------
    name : str
        Of the place on the page.
    speed, node, harmonic : array
        Of the spectra; rad/s.
    spectra : dict
        Name -> (label, colour, (speed, node, harmonic) complex, m), the measured one first.
    std : dict
        Name -> (speed, node, harmonic) m, standard deviations of some of them.
    start : (int, int)
        Positions of the speed and the node shown first.
    axes : dict, optional
        `mark_rad`, and `clearance_m` (node -> radius); see `axes_of`.
    told : list of str, optional
        What to say after each speed.
    sigma : sequence of (label, colour, (speed, node, harmonic))
        Residuals in standard deviations.
    signals : callable, optional
        Position of a speed -> what to show instead of the sum of the harmonics, for each node, or None.
    """
    unit, factor = shown_unit("m")
    kept, axes = _thinned(len(speed), MOST_SPEEDS), axes or {}
    says = [f"{spin(w)}{', ' + text if text else ''}" for w, text in zip(speed, told or [""] * len(speed), strict=True)]
    found = {
        "name": name,
        "unit": unit,
        "speed": [says[i] for i in kept],
        "node": [str(one) for one in node],
        "harmonic": [int(n) for n in harmonic],
        "start": [int(np.argmin(abs(kept - start[0]))), int(start[1])],
        "mark": float(axes.get("mark_rad", 0.0)),
        "clearance": {key: factor * radius for key, radius in axes.get("clearance_m", {}).items()},
        "names": [[key, label, colour] for key, (label, colour, _) in spectra.items()],
        "values": {key: parts(factor * values[kept]) for key, (_, _, values) in spectra.items()},
        "std": {key: rounded(factor * values[kept]) for key, values in std.items()},
    }
    if sigma:
        found["sigma"] = [[label, colour, rounded(values[kept])] for label, colour, values in sigma]
    if signals:
        found["signals"] = [signals(int(i)) for i in kept]
    return found


def axes_of(model, rig):
    """What the charts need of a model and its rig, as JSON for the attribute `axes` of a Dataset: mark, clearances."""
    clearance = {}
    for item in rig.get("bearings") or []:
        if isinstance(radius := item.get("radial_clearance_m"), (int, float)):
            clearance[str(item.get("node", model.structure.nodes[0]))] = radius
    probes = {str(node): model.structure.reading.probes_at(node) for node in model.sensors}
    return json.dumps({"mark_rad": float(model.structure.reading.mark_rad), "clearance_m": clearance, "probes": probes})


def along_probes(directions, mark, harmonic, amplitude):
    """{probe: (speed,) complex} of 1X along probes; amplitude (speed, harmonic) complex, phase leading the mark."""
    order = list(harmonic)
    forward, backward = (amplitude[:, order.index(n)] for n in (1, -1))
    turned = {probe: np.exp(-1j * at) for probe, at in directions.items()}
    return {probe: np.exp(1j * mark) * (t * forward + np.conj(t * backward)) for probe, t in turned.items()}


def deviations(spectrum):
    """(speed, node, harmonic) m: standard deviations of the harmonics of a Spectrum."""
    variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)
    return np.sqrt(variance.reshape(*variance.shape[:-1], 2, -1).sum(axis=-2))


def parts(values):
    """Real and imaginary parts of an array, for JSON."""
    return {"real": rounded(values.real), "imag": rounded(values.imag)}


def rounded(values, digits=DIGITS):
    """Nested lists with `digits` significant digits; JSON has no NaN: what is not known is null."""
    values = np.asarray(values, float)
    known = np.isfinite(values) & (values != 0)
    power = 10.0 ** (digits - 1 - np.floor(np.log10(np.abs(np.where(known, values, 1.0)))))
    found = np.round(np.where(known, values, 0.0) * power) / power
    return _without_nan(np.where(np.isfinite(values), found, np.nan).tolist())


def _without_nan(values):
    if isinstance(values, list):
        return [_without_nan(one) for one in values]
    return None if values != values else float(f"{values:.12g}")


def _thinned(count, most):
    """Positions of at most `most` of `count`, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))
