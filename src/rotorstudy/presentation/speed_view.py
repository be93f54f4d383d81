"""What the interactive view of a diagnosis shows: orbit, spectrum and residual at the speed that a reader chooses.

The view is SVG with a short script in `templates/speed_view.html`, not a plotting library: Plotly or Bokeh inlined
would add one to four megabytes to every page, which has about half of one.
"""

import numpy as np

from rotorstudy.presentation.diagnosis_figures import shown_speed, worst_nodes
from rotorstudy.store import as_complex

MOST_SPEEDS = 120  # of a run-up, evenly spaced
DIGITS = 4  # significant ones, as a picture shows no more


def speed_view(data):
    """The numbers of the view, for JSON.

    Parameters
    ----------
    data : xarray.Dataset
        The content of verdict.nc.

    Returns
    -------
    dict
        speed (rad/s), held_out, harmonic and node; real and imaginary parts (µm) of measured, base and extended, and
        standard_deviation (µm), before and after (standard deviations), each by speed, node and harmonic; start, the
        positions of the speed and node shown first.
    """
    count = data.sizes["speed"]
    kept = np.unique(np.linspace(0, count - 1, min(count, MOST_SPEEDS)).round().astype(int))
    start = int(np.argmin(abs(kept - shown_speed(data)))), int(worst_nodes(data, 1)[0])
    data = data.isel(speed=kept).transpose("speed", "node", "harmonic", ...)
    found = {
        "speed": _rounded(data.speed.values, 6),
        "held_out": data.held_out.values.tolist(),
        "harmonic": data.harmonic.values.tolist(),
        "node": data.node.values.tolist(),
        "start": start,
        "standard_deviation": _rounded(1e6 * data.standard_deviation.values),
        "before": _rounded(data.residual_before.values),
        "after": _rounded(data.residual_after.values),
    }
    for name in ("measured", "base", "extended"):
        values = 1e6 * as_complex(data[name])
        found[name] = {"real": _rounded(values.real), "imag": _rounded(values.imag)}
    return found


def _rounded(values, digits=DIGITS):
    """Nested lists with `digits` significant digits; JSON has no NaN, what is not known is drawn as zero."""
    return np.vectorize(lambda value: float(f"{value:.{digits}g}"))(np.nan_to_num(values)).tolist()
