"""Figures of a diagnosis: residual maps, ranked causes, spectra before and after, error on held-out speeds, states."""

import json
import re
from itertools import product
from textwrap import fill, shorten

import numpy as np

from rotorstudy import units
from rotorstudy.presentation.charts import speed_view, thinned
from rotorstudy.presentation.plots import COLOURS, figure, finished, harmonic_axis, plot_orbit
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex
from rotorstudy.units import number, percent, quantity, shown_unit, spin

MOST_NODES = 6  # maps below each other
MOST_ROWS = 48  # of all of them, one for a speed
MOST_BARS = 24  # pairs of the gain
MOST_COMPARED = 3  # nodes of the spectra, and of both states
REACH = 2.45  # standard deviations of a 95 % circle of a complex number, each of its parts with one
FEWEST_CAUSES, MOST_CAUSES = 5, 10
LEAST_SHOWN = 0.001  # probability
MOST_DECADES, BAR = 12, 0.05  # of the odds drawn; length of the bar of even odds
SMALL = 1e-3  # m; shorter lengths are written in µm
MOST_TICKS = 12
ROW, LINE = 0.25, 0.125  # inches: least height of a row of `causes`, height of a line of its text
SHAPE = re.compile(r"(\w+?)_(rad_per_s|N_m|rad|m|s) (-?\d[\w.+-]*)")  # an option of a cause with its value in SI
ORBITS = ((1, "--"), (0, "-"), (6, ":"))  # colour and line of the first, second and third drawn
BASE, EXTENDED, MEASURED = COLOURS[1], COLOURS[0], COLOURS[6]
SHOWN = {"base": "rig as given, fitted", "extended": "with what was added"}


def diagnosis_figures(verdict, data):
    """Every figure of a diagnosis by name."""
    return {
        "what_is_wrong": what_is_wrong(data),
        "causes": causes(data, verdict.settings.naming_probability, verdict.verdict),
        "before_and_after": before_and_after(data),
        "gain": gain(data),
    }


def worst_nodes(data, count):
    """Positions of the `count` nodes with the largest residual before, in the order of the rotor."""
    size = (data.residual_before**2).mean(("speed", "harmonic")).values
    return np.sort(np.argsort(-size)[:count])


def some_speeds(data, most):
    """The data at no more than so many of its speeds, evenly among them."""
    return data.isel(speed=thinned(data.sizes["speed"], most))


def what_is_wrong(data):
    """Maps over speed and harmonic, one row per node: residual in standard deviations and equivalent residual force."""
    from matplotlib.colors import LogNorm

    nodes, count = worst_nodes(data, MOST_NODES), data.sizes["speed"]
    data = some_speeds(data, max(MOST_ROWS // len(nodes), 12)).sortby("harmonic")
    picture, axes = figure(len(nodes), 4, height=max(2.0, 0.17 * len(data.speed) + 0.8) + 0.9 / len(nodes), width=2.3)
    sigma = {when: data[f"residual_{when}"].values for when in ("before", "after")}
    force = {when: np.abs(as_complex(data[f"equivalent_residual_force_{when}"])) for when in ("before", "after")}
    largest, step = max(force["before"].max(), 1e-12), int(np.ceil(data.sizes["speed"] / MOST_TICKS))
    held_out, names = data.held_out.values, [f"{n}X" for n in data.harmonic.values]
    labels = [own_unit(w) + "*" * int(held) for w, held in zip(data.speed.values, held_out, strict=True)]
    kinds = (
        ("residual", sigma, LogNorm(1, max(10.0, sigma["before"].max())), "viridis", "standard deviations"),
        ("force", force, LogNorm(1e-3 * largest, largest), "magma", "equivalent residual force (N)"),
    )
    for column, ((name, values, norm, colours, label), when) in enumerate(product(kinds, ("before", "after"))):
        for row, node in enumerate(nodes):
            ax = axes[row, column]
            image = ax.pcolormesh(np.maximum(values[when][:, :, node], norm.vmin), norm=norm, cmap=colours)
            ax.grid(False)
            ax.set_xticks(np.arange(len(names)) + 0.5, names if row == len(nodes) - 1 else [], rotation=90)
            ax.set_yticks(np.arange(len(labels))[::step] + 0.5, [] if column else labels[::step])
            if not column:
                ax.set_ylabel(f"node {data.node.values[node]}\nspeed ({units.shown_speed()[0]})")
        axes[0, column].set_title(f"{name}, {when}")
        if when == "after":
            beside = axes[:, column - 1 : column + 1]
            picture.colorbar(image, ax=beside, label=label, location="bottom", shrink=0.7, aspect=30)
    held = " (* held out)" if held_out.any() else ""
    held += f"; {data.sizes['speed']} of {count} speeds" if data.sizes["speed"] < count else ""
    return finished(picture, f"Speed over harmonic (backward < 0 < forward){held}", size=8)


def own_unit(speed):
    """2865, a speed in the reader's unit."""
    return number(speed * units.shown_speed()[1], 4)


def causes(data, naming_probability, verdict):
    """Explanations, the most probable first: odds of the first against each, its probability and residual."""
    odds = data.log_posterior_odds.values
    shown = np.argsort(-odds, kind="stable")
    likely = shown[(data.posterior_probability.values[shown] >= LEAST_SHOWN) | (data.is_best.values[shown] == 1)]
    shown = shown[: min(max(len(likely), FEWEST_CAUSES), MOST_CAUSES)]
    part = data.isel(explanation=shown)
    components = 2 * int((data.held_out == 0).sum()) * data.sizes["harmonic"] * data.sizes["node"]
    labels = [fill(shorten(in_words(text), 126, placeholder=" ..."), 44) for text in part.explanation_label.values]
    tallest = max(ROW, LINE * max(text.count("\n") + 1 for text in labels))
    (picture, ((ax,),)), place = figure(height=1.4 + tallest * len(shown), width=6.5), np.arange(len(shown))
    against = np.minimum((odds.max() - part.log_posterior_odds.values) / np.log(10), MOST_DECADES)
    for best, alternative, colour, label in (
        (1, 0, EXTENDED, "closest explanation" if verdict == "unknown" else "the verdict"),
        (0, 1, COLOURS[4], "cannot be ruled out"),
        (0, 0, "#BBBBBB", "less likely"),
    ):
        chosen = (part.is_best.values == best) & (part.is_alternative.values == alternative)
        if chosen.any():
            hatch = "//" if alternative else None
            ax.barh(place[chosen], against[chosen] + BAR, 0.7, -BAR, color=colour, label=label, hatch=hatch)
    left = np.sqrt(part.cost.values / components)
    for y, value, size, probability in zip(place, against, left, part.posterior_probability.values, strict=True):
        share = f"{100 * probability:.1f} %, " if probability >= LEAST_SHOWN and verdict != "unknown" else ""
        ax.text(value, y, f"  {share}{size:.3g} σ", va="center", fontsize=7)
    ax.set_xlim(-BAR, max(1.35 * against.max(), 1.5))
    ax.set_yticks(place, labels, fontsize=6.5)
    ax.invert_yaxis()
    ax.set_xlabel(
        f"odds of the first one against it, powers of ten (at most {MOST_DECADES} drawn)\n"
        "at the bars: probability, and rms residual in standard deviations"
    )
    titles = {
        "unknown": "No explanation is accepted",
        "nothing": "Nothing is missing",
        "cause": f"A cause that has {percent(naming_probability)} or more over all explanations is named",
        "ambiguous": "Several causes cannot be told apart",
    }
    ax.set_title(titles[verdict])
    return finished(picture, legend=3, loc="outside upper center")


def in_words(label):
    """An explanation with units instead of keys: 'direction 9.88 °' for direction_rad 0.1725."""

    def shown(found):
        name, unit, value = found.groups()
        unit, value = unit.replace("_per_", "/").replace("_", " "), float(value)
        if unit == "m" and abs(value) >= SMALL:
            return f"{name} {number(1e3 * value)} mm"
        return f"{name} {quantity(value, unit)}"

    harmonics = {}
    for part in SHAPE.sub(shown, str(label)).replace("_", " ").split(" + "):
        effect, _, harmonic = part.partition(", harmonic ")
        harmonics.setdefault(effect, []).extend([harmonic] if harmonic else [])
    said = []
    for effect, found in harmonics.items():
        several = f", harmonics {', '.join(found[:-1])} and {found[-1]}" if len(found) > 1 else None
        said.append(effect + (several or "".join(f", harmonic {one}" for one in found)))
    return " + ".join(said)


def shown_speed(data):
    """Position of the speed with the largest residual before, among the held-out speeds if there are any."""
    size = (data.residual_before**2).mean(("harmonic", "node")).values
    allowed = data.held_out.values.astype(bool)
    return int(np.argmax(np.where(allowed, size, -1) if allowed.any() else size))


def before_and_after(data):
    """Measured, base and extended spectra and orbits at one speed, one row per node."""
    speed, nodes = shown_speed(data), worst_nodes(data, MOST_COMPARED)
    here, (unit, factor) = data.isel(speed=speed), shown_unit("m")
    harmonics, w = data.harmonic.values, float(data.speed[speed])
    spectra = {name: as_complex(here[name].transpose("harmonic", "node", "part")) for name in ("base", "extended")}
    measured = as_complex(here.measured.transpose("harmonic", "node", "part"))
    std = here.standard_deviation.values
    floor = 0.3 * min(std.min() if std.min() > 0 else np.inf, np.abs(measured[measured != 0]).min())
    axes_of = json.loads(data.attrs.get("axes", "{}"))
    picture, axes = figure(len(nodes), 2, height=2.5, width=3.6, width_ratios=(2, 1))
    for row, node in enumerate(nodes):
        ax, orbit = axes[row]
        for k, (name, colour) in enumerate((("base", BASE), ("extended", EXTENDED))):
            size = np.maximum(np.abs(spectra[name][:, node]), floor)
            ax.bar(harmonics + 0.36 * (k - 0.5), factor * size, 0.34, color=colour, label=SHOWN[name])
        size = np.abs(measured[:, node])
        reach = 2 * std[:, node]
        bars = factor * np.array([np.minimum(reach, np.maximum(size - floor, 0)), reach])
        style = {"fmt": "o", "color": MEASURED, "markersize": 3, "label": "measured, bars of 2 σ"}
        ax.errorbar(harmonics, factor * size, yerr=bars, **style)
        ax.set_yscale("log")
        ax.set_ylim(bottom=factor * floor)
        ax.set_ylabel(f"node {data.node.values[node]}: amplitude ({unit})")
        harmonic_axis(ax, harmonics)
        of_node = [values[:, node] for values in (spectra["base"], spectra["extended"], measured)]
        _orbits(orbit, of_node, ("base", "extended", "measured"), harmonics, w, axes_of.get("mark_rad", 0.0))
        if row == 0:
            seen = "held out of every fit" if data.held_out.values[speed] else "fitted"
            ax.set_title(f"{spin(w)}, {seen}")
            orbit.set_title("orbits about their means\ndashed: rig as given; dotted: measured", fontsize=7)
        if radius := axes_of.get("clearance_m", {}).get(str(int(data.node.values[node]))):
            turn = factor * radius * np.exp(1j * np.linspace(0, 2 * np.pi, 100))
            orbit.plot(turn.real, turn.imag, color="0.6", linewidth=0.8)  # the clearance of its bearing
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return picture


def gain(data):
    """Error before and after by held-out speed (fitted speed if none is held out) and node, in µm and sigma."""
    from matplotlib.ticker import LogLocator, NullLocator

    held = data.held_out.values.astype(bool)
    chosen = data.isel(speed=held) if held.any() else data
    count, chosen = chosen.sizes["speed"], some_speeds(chosen, max(MOST_BARS // chosen.sizes["node"], 1))
    picture, axes = figure(1, 2, height=3.1)
    unit, factor = shown_unit("m")
    nodes = [f", node {node}" if chosen.sizes["node"] > 1 else "" for node in chosen.node.values]
    labels = [own_unit(w) + node for w in chosen.speed.values for node in nodes]
    measured = as_complex(chosen.measured)
    for k, (when, name, colour) in enumerate((("before", "base", BASE), ("after", "extended", EXTENDED))):
        off = np.abs(measured - as_complex(chosen[name]))
        length = factor * np.sqrt(np.mean(off**2, axis=1)).ravel()
        sigma = np.sqrt((chosen[f"residual_{when}"] ** 2).mean("harmonic")).values.ravel()
        place = np.arange(len(length)) + 0.38 * (k - 0.5)
        for ax, values in zip(axes[0], (length, sigma), strict=True):
            ax.bar(place, values, 0.36, color=colour, label=SHOWN[name])
    for ax, label in zip(axes[0], (f"rms error ({unit})", "error (standard deviations)"), strict=True):
        ax.set_yscale("log")
        ax.set_ylim(bottom=0.5 * min(bar.get_height() for bar in ax.patches) or None)
        ax.set_xticks(np.arange(len(labels)), labels, rotation=90 if len(labels) > 4 or len(nodes) > 1 else 0)
        ax.set_ylabel(label)
        ax.set_xlabel(f"speed ({units.shown_speed()[0]})" + ", node" * (len(nodes) > 1))
        ax.set_xlim(-0.6, max(len(labels), 4) - 0.4)
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_locator(NullLocator())
    axes[0, 1].axhline(1, color="k", linewidth=0.8, linestyle=":")
    some = f", {chosen.sizes['speed']} of {count}" if chosen.sizes["speed"] < count else ""
    axes[0, 0].set_title(("held-out speeds" if held.any() else "fitted speeds (none was held out)") + some)
    axes[0, 1].set_title("1: noise and stated model error alone")
    return finished(picture, legend=2)


def two_states(before, after, difference, mark=0.0):
    """Orbits at the speed of the largest change, and 1X at all speeds, a row per node, of two Spectra; mark : rad."""
    from matplotlib.patches import Circle

    moving = difference.harmonics != 0
    change = np.sum(np.abs(difference.amplitude[:, moving]) ** 2, axis=1)  # (speed, sensor)
    speed = int(change.sum(axis=1).argmax())
    nodes = np.sort(np.argsort(-change.sum(axis=0))[:MOST_COMPARED])
    first = difference.harmonics.tolist().index(1)
    unit, factor = shown_unit("m")
    reach = factor * REACH * np.sqrt(difference.variance[:, first] / 2)
    w = float(after.speed[speed])
    picture, axes = figure(len(nodes), 2, height=3.0, width=3.4)
    for row, node in enumerate(nodes):
        orbit, vectors = axes[row]
        of_node = [one.amplitude[speed, :, node] for one in (before, after)]
        _orbits(orbit, of_node, ("before", "after"), after.harmonics, w, mark)
        for one, name, index in ((before, "before", 1), (after, "after", 0)):
            vector = factor * one.amplitude[:, first, node]
            vectors.plot(vector.real, vector.imag, "o" if index else "s", color=COLOURS[index], label=name)
        ends = [factor * one.amplitude[:, first, node] for one in (before, difference)]
        for start, change, radius in zip(*ends, reach[:, node], strict=True):  # each change with its 95 % circle
            end, arrow = start + change, {"arrowstyle": "->", "color": COLOURS[2], "linewidth": 0.8}
            vectors.annotate("", (end.real, end.imag), (start.real, start.imag), arrowprops=arrow)
            vectors.add_patch(Circle((end.real, end.imag), radius, fill=False, color=COLOURS[2], linewidth=0.6))
        orbit.set_title(f"node {after.sensors[node]}: orbits at {spin(w)}")
        vectors.set_title("1X at all speeds, arrow: its change")
        vectors.set_aspect("equal", adjustable="datalim")
        vectors.set_xlabel(f"real part of 1X ({unit})")
        vectors.set_ylabel(f"imaginary part of 1X ({unit})")
        if row == 0:
            orbit.legend(loc="best")
            vectors.legend(loc="best")
    return picture


def _orbits(axes, motions, names, harmonics, speed, mark):
    """One revolution of motions (harmonic,) about their means, in the style of each, from the phase mark on."""
    time = (mark + np.linspace(0, 2 * np.pi, 400)) / speed
    for motion, name, (index, line) in zip(motions, names, ORBITS, strict=False):
        signal = synthesize(np.where(harmonics == 0, 0, motion), speed, harmonics, time)
        plot_orbit(signal, axes, index=index, label=name, linestyle=line, mark=True)


def both_states(before, after, axes):
    """Charts of both states side by side; axes : of `charts.axes_of`."""
    states = {"before": (before, 1), "after": (after, 0)}
    spectra = {name: (name, colour, one.amplitude.transpose(0, 2, 1)) for name, (one, colour) in states.items()}
    std = {name: np.sqrt(one.variance).transpose(0, 2, 1) for name, (one, _) in states.items()}
    change = np.abs(spectra["after"][2] - spectra["before"][2])[..., after.harmonics != 0].sum(axis=2)
    start = tuple(map(int, np.unravel_index(change.argmax(), change.shape)))
    return speed_view("states", after.speed, after.sensors, after.harmonics, spectra, std, start, axes)
