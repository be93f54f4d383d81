"""Where -1X of both test rigs comes from: the probes they share, the runout of each, both, or a force on each.

Probes that are not orthogonal, or have unequal gains, add s conj(R_1) to R_-1, with one complex share s for as long as
the probes stay: s = j sigma / 2 for axes sigma from a right angle, a real s for unequal gains. Runout adds a constant
to R_-1 of each rig. A backward force independent of the speed, as of a misaligned coupling, adds its response.
"""

import numpy as np
import pandas as pd

from rotorstudy.model.rig_items import make_term
from rotorstudy.response.measured import measured_response
from rotorstudy.store import as_complex
from thesis.config import load_replay
from thesis.replay import COLUMN
from thesis.texts import page

READING_M = 1e-6  # standard deviation of a reading; the unexplained 5X and 7X of the first rig are of this size
METHOD = 0.02  # relative standard deviation: two spectrum methods differ by 1 to 2 % on the same record


def hypotheses(rig, forward, backward, receptance, std):
    """A DataFrame of fits of -1X by a share of conj(+1X), by runout and by a constant force, by weighted least squares.

    All (reading,): rig, its number; forward, backward, m; receptance, -1X of a backward force of 1 N, m/N; std, m, of
    the real and of the imaginary part of -1X. Shares, their standard deviations and angles are lists.
    """
    from scipy.special import chdtrc

    here = (rig[:, None] == np.unique(rig)).astype(float)  # (reading, rig)
    mirrored = forward.conj()[:, None]
    columns = {
        "one share for both rigs": (mirrored,),
        "one share for each rig": (mirrored * here,),
        "runout of each rig": (here,),
        "one share for both rigs, and runout of each": (mirrored, here),
        "constant force on each rig": (receptance[:, None] * here,),
    }
    rows = []
    for name, blocks in columns.items():
        design = np.hstack(blocks) / std[:, None]
        found, *_ = np.linalg.lstsq(design, backward / std, rcond=None)
        square = float(np.sum(np.abs(backward / std - design @ found) ** 2))
        freedom = 2 * (len(backward) - design.shape[1])
        shares = range(blocks[0].shape[1]) if "share" in name else []
        deviation = np.sqrt(np.diag(np.linalg.inv(design.conj().T @ design)).real)
        rows.append(
            {
                "hypothesis": name,
                "chi-square": square,
                "degrees of freedom": freedom,
                "p-value": float(chdtrc(freedom, square)),
                "share": [float(abs(found[i])) for i in shares],
                "standard deviation": [float(deviation[i]) for i in shares],
                "angle": [float(np.degrees(np.angle(found[i]))) for i in shares],
            }
        )
    return pd.DataFrame(rows)


def receptance_at(model, speeds):
    """-1X (speed,) of a backward force of 1 N at the disc, m/N; damping hardly matters far below the critical speed."""
    force = {"kind": "parallel_misalignment", "harmonics": [-1]}
    pushed = model.plus(make_term("effect", force, model.structure, model.sensors))
    alone = np.zeros(len(pushed.names))
    alone[pushed.names.index("misalignment_force_-1X_real")] = 1.0
    return measured_response(pushed, speeds, [-1], alone)[:, 0, 0]


def backward_1x_table(configs, **spectra):
    """What the published -1X of both rigs says about probes and runout; configs : name of a replay -> its file."""
    readings = []
    for number, (name, path) in enumerate(configs.items()):
        config = load_replay(path)
        seen = spectra[name].compensated.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
        both = (as_complex(seen.sel(harmonic=n)) for n in (1, -1))
        readings += [(number, *one) for one in zip(*both, receptance_at(config.model, config.speeds), strict=True)]
    rig, forward, backward, receptance = map(np.array, zip(*readings, strict=True))
    rows = hypotheses(rig, forward, backward, receptance, np.hypot(READING_M, METHOD * np.abs(backward)))
    for name in ("share", "standard deviation", "angle"):
        rows[name] = [", ".join(f"{value:.3g}" for value in values) for values in rows[name]]
    rows = rows.rename(columns={"angle": "angle (deg)"})
    assumed = {"reading": READING_M * 1e6, "method": METHOD * 100}
    return {"backward_1X": page("backward_1X", rows, digits=3, **assumed)}
