"""The figure of both test rigs of the thesis side by side."""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, save_figure
from rotorstudy.presentation.tables import write_tables
from thesis.backward_1x import backward_1x_table
from thesis.checks import names_of_either_sign
from thesis.config import load_replay
from thesis.figures.replays import symbol
from thesis.replay import COLUMN
from thesis.rigs import rigs_table, slow_roll_parts

MOSTLY = 0.7  # share of -1X at slow roll above which -1X is attributed to it


def rigs_figure(replays, table):
    """Parameters of several rigs beside their limits, from (ReplayConfig, identification, spectra) of each."""
    parameters = list(dict.fromkeys(table.parameter))
    picture, axes = figure(height=4.2, width=5.0)
    narrower = table.groupby("parameter")["largest possible"].min()[parameters]
    both_signs = np.isin(parameters, [name for config, _, _ in replays for name in names_of_either_sign(config)])
    for part, sides, alpha in (("possible", 1, 0.25), ("possible in size", np.where(both_signs, -1, 0), 0.12)):
        place = np.arange(len(parameters))
        axes[0, 0].barh(place, sides * narrower, 0.8, color=COLOURS[2], alpha=alpha, label=part)
    for r, rig in enumerate(dict.fromkeys(table.rig)):
        part = table[table.rig == rig].set_index("parameter").loc[parameters]
        for s, (source, column) in enumerate((("thesis", "thesis"), ("least squares", "least squares: estimate"))):
            axes[0, 0].plot(
                part[column],
                np.arange(len(parameters)) + 0.3 * (r - 0.5),
                MARKERS[r],
                color=COLOURS[s],
                fillstyle=("none", "full")[s],
                label=f"{rig}, {source}",
            )
    axes[0, 0].axvline(0, color="k", linewidth=0.8)
    axes[0, 0].set_xscale("symlog", linthresh=0.1)
    axes[0, 0].margins(x=0.08)
    axes[0, 0].set_yticks(range(len(parameters)), [symbol(name) for name in parameters])
    axes[0, 0].invert_yaxis()
    if min(slow_roll_parts(config, spectra)[-1].min() for config, _, spectra in replays) > MOSTLY:
        title = "Both rigs: -1X of the slow roll is attributed to a crack"
    else:
        title = "Parameters identified for both rigs"
    axes[0, 0].set(xlabel=f"dimensionless estimate (1); all speeds, column '{COLUMN}'", title=title)
    picture.legend(loc="outside lower center", ncols=2)
    return picture


def write(sheets, pictures, configs, reference, index, **results):
    """Write tables and figure of both rigs.

    sheets, pictures : paths;  configs : name of a replay -> its file;  index : the page of all results
    results : name of a replay -> its Datasets `identification` and `spectra`
    """
    replays = [
        (load_replay(path), results[name]["identification"], results[name]["spectra"]) for name, path in configs.items()
    ]
    table = rigs_table(replays, reference)
    write_tables({"comparison": table, "backward_1X": backward_1x_table(replays)}, sheets, index)
    save_figure(rigs_figure(replays, table.rows), *pictures)
