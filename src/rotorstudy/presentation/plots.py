"""Figures: one style, and the plots common in rotordynamics."""

import textwrap
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:  # importing it takes a second
    from matplotlib.axes import Axes

from rotorstudy.store import atomic, files_by_name
from rotorstudy.units import shown_unit

# Okabe and Ito: distinguishable for colour-blind readers and in grey print
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
COLUMN_WIDTH = 3.5  # inches, one column of a journal
STYLE = {
    "font.size": 8,
    "axes.titlesize": 8,
    "figure.titlesize": 9,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.min_exponent": 3,  # of a logarithmic axis: 0.2 instead of 2 x 10^-1
    "grid.alpha": 0.3,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "svg.hashsalt": "rotorstudy",
    "figure.dpi": 100,
    "savefig.dpi": 200,
}


def figure(rows=1, columns=1, height=2.4, width=COLUMN_WIDTH, **options):
    """A figure of panels in the project's style: figure, axes (rows, columns); height is that of one row, inches."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(STYLE)
    plt.rcParams["axes.prop_cycle"] = plt.cycler(color=COLOURS)
    size = (width * columns, height * rows)
    return plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)


def finished(picture, told=None, legend=None, size=STYLE["figure.titlesize"], **options):
    """A figure with the title `told`, and a legend, in so many columns, of what is labelled in any of its panels.

    size : of the title;  options : of the legend
    """
    if legend:
        shown = {}
        for panel in picture.axes:
            for handle, text in zip(*panel.get_legend_handles_labels(), strict=True):
                shown.setdefault(text, handle)
        picture.legend(shown.values(), shown, **{"loc": "outside lower center", "ncols": legend, **options})
    if told:
        picture.suptitle(told, fontsize=size)
    return picture


def curves(panel, values, over, by, styles=None, **options):
    """Draw a DataArray over a DataArray of one of its dimensions, a labelled curve for each place along another one."""
    for i, name in enumerate(values[by].values):
        style = styles(i) if styles else {"color": COLOURS[i % len(COLOURS)]}
        panel.plot(over, values.sel({by: name}), **{"label": label(name), **style, **options})


def _lay_out(picture, dpi):
    """Fix the layout of a figure that is then saved with this dpi; with a layout engine, each file is drawn twice."""
    picture.set_dpi(dpi)
    if engine := picture.get_layout_engine():
        engine.execute(picture)
        if _wrap_what_is_cut(picture):
            engine.execute(picture)
        picture.set_layout_engine(None)


def _wrap_what_is_cut(picture):
    """Break titles, and labels of axes along x, that reach beyond the figure into lines; whether any did."""
    whole = picture.get_window_extent()
    texts = [picture._suptitle, *(text for axes in picture.axes for text in (axes.title, axes.xaxis.label))]
    cut = False
    for text in filter(None, texts):
        seen = text.get_window_extent()
        if (seen.x0 < whole.x0 or seen.x1 > whole.x1) and "\n" not in text.get_text():
            middle, said = (seen.x0 + seen.x1) / 2, text.get_text()
            room = 1.94 * min(middle - whole.x0, whole.x1 - middle)
            lines = int(np.ceil(seen.width / room))
            fitting = int(len(said) * room / seen.width)
            text.set_text(textwrap.fill(said, min(len(said) // lines + 8, fitting)))  # of about equal length
            cut = True
    return cut


def save_figure(picture, *paths):
    """Write a figure to every path given (PNG, SVG, PDF), atomically and without the date: rebuilds are identical."""
    import matplotlib.pyplot as plt

    without_date = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    _lay_out(picture, STYLE["savefig.dpi"])
    for path in paths:
        with atomic(path) as temporary:
            if temporary.suffix == ".png":
                _save_png(picture, temporary)
            else:
                picture.savefig(temporary, metadata=without_date[temporary.suffix])
    plt.close(picture)


def _save_png(picture, file):
    """Write a PNG with at most 256 colours: less than half of its size otherwise, and no difference that is seen."""
    from PIL import Image

    picture.canvas.draw()
    image = Image.frombuffer("RGBA", picture.canvas.get_width_height(), picture.canvas.buffer_rgba())
    image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, "PNG")


def png_bytes(picture, dpi):
    """A figure as the content of a PNG file; the figure is closed."""
    import io

    import matplotlib.pyplot as plt

    stream = io.BytesIO()
    _lay_out(picture, dpi)
    _save_png(picture, stream)
    plt.close(picture)
    return stream.getvalue()


def save_pictures(figures, folder):
    """Write figures as PNG and SVG into a folder; {name: path of the PNG}."""
    for name, picture in figures.items():
        save_figure(picture, folder / f"{name}.png", folder / f"{name}.svg")
    return {name: folder / f"{name}.png" for name in figures}


def save_figures(figures, paths):
    """Write every figure to the files of its name."""
    for name, files in files_by_name("figure", figures, paths).items():
        save_figure(figures[name], *files)


def label(parameter):
    """A parameter as figures name it."""
    named = str(parameter).replace("_", " ").replace("stiffness loss", "crack stiffness")
    return named.replace("eccentricity phase", "unbalance phase")


def harmonic_axis(axes, harmonics):
    """Label an axis of harmonics -5X ... 7X."""
    shown = np.sort(np.asarray(harmonics))
    axes.set_xticks(shown, [f"{int(n)}X" for n in shown], rotation=90)
    axes.set_xlabel("harmonic (backward < 0 < forward)")


def plot_full_spectrum(
    harmonics: Iterable[int],
    amplitude: ArrayLike,
    axes: "Axes | None" = None,
    *,
    label: str | None = None,
    index: int = 0,
    count: int = 1,
) -> "Axes":
    """Bars of |R_n| over the harmonics, in the reader's unit, on a logarithmic scale.

    Parameters
    ----------
    harmonics : ints (harmonic,)
        Harmonics n > 0 forward, n < 0 backward.
    amplitude : array (harmonic,)
        Complex, m.
    axes : Axes, optional
        Where to draw; a new figure by default.
    label : str, optional
        In the legend.
    index : int, optional
        Which of `count` spectra side by side.
    count : int, optional
        How many stand side by side.

    Returns
    -------
    Axes
    """
    if axes is None:
        axes = figure()[1][0, 0]
    width, (unit, factor) = 0.8 / count, shown_unit("m")
    place = np.asarray(harmonics) + (index - (count - 1) / 2) * width
    axes.bar(place, np.abs(amplitude) * factor, width=width, color=COLOURS[index % len(COLOURS)], label=label)
    axes.set_yscale("log")
    axes.set_ylabel(f"amplitude ({unit})")
    harmonic_axis(axes, harmonics)
    return axes


def phase_lag(vectors):
    """Phase lag (speed,) in degrees of vectors over speed, complex, unwrapped, starting between 0 and 360."""
    lag = np.rad2deg(np.unwrap(-np.angle(vectors)))
    return lag - 360 * np.floor(lag[0] / 360)


def plot_orbit(signal, axes, *, label=None, index=0, linestyle="-", linewidth=0.9, mark=False):
    """Orbit of one node: y over x in the reader's unit, x pointing down as gravity does; signal (time,) complex, m.

    mark : whether the phase mark passes at the first instant, which is then a dot
    """
    unit, factor = shown_unit("m")
    style = {"color": COLOURS[index], "linewidth": linewidth, "linestyle": linestyle}
    axes.plot(signal.imag * factor, signal.real * factor, label=label, **style)
    if mark:
        axes.plot(signal[0].imag * factor, signal[0].real * factor, "o", color=COLOURS[index], markersize=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"horizontal y ({unit})")
    axes.set_ylabel(f"vertical x, down ({unit})")
    if not axes.yaxis_inverted():
        axes.invert_yaxis()
    return axes
