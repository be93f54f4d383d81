"""The probes of a rig file as a picture: where they are, the phase mark, gravity and the sense of rotation."""

from textwrap import fill

import numpy as np

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.model.rig import read_rig
from rotorstudy.presentation.plots import COLOURS, figure, finished, save_figure

PROBE, LABEL = 1.45, 1.95  # radii at which a probe ends and its name stands, the shaft being 1
APART = 0.42  # rad between two labels, the width of one at that radius
SPREADS, TINY = 100, 1e-3  # rounds in which labels are moved apart, and how far beyond what is needed (rad)
MOST = 6  # nodes drawn
CHARACTERS = 36  # of a title above one node
BLANK = {"facecolor": "w", "edgecolor": "none", "pad": 0.5}  # behind a text


def draw_probes(rig_path, path):
    """Draw the probes of a rig file to a file; its path, None if it has none."""
    rig = read_rig(rig_path)
    conventions = read_conventions(rig.given, str(rig.path))
    if not conventions.probes:
        return None
    save_figure(probe_picture(conventions, rig.model.structure.nodes, rig.model.structure.labels), path)
    return path


def probe_picture(conventions, nodes, labels=None):
    """A cross section of the shaft at each node with probes, in the view of the rig file, angles counter-clockwise."""
    at = {node: [p for p in conventions.probes if p.node in (None, node)] for node in nodes}
    at = {node: probes for node, probes in at.items() if probes}
    shown = list(at)[:MOST]
    picture, axes = figure(1, len(shown), height=3.1, width=2.9)
    for node, panel in zip(shown, axes[0], strict=True):
        angles = [conventions.keyphasor.sensor_angle_deg, *(probe.angle_deg for probe in at[node])]
        mark, *labels_at = spread(_on_page(conventions, angle) for angle in angles)
        _section(panel, conventions, mark)
        for i, (probe, label_at) in enumerate(zip(at[node], labels_at, strict=True)):
            direction, colour = _on_page(conventions, probe.angle_deg), COLOURS[i % len(COLOURS)]
            line = {"arrowstyle": "-", "color": colour, "linewidth": 5}
            panel.annotate("", 1.05 * _xy(direction), PROBE * _xy(direction), arrowprops=line)
            text = {"ha": "center", "va": "center", "fontsize": 8, "color": colour}
            panel.text(*(LABEL * _xy(label_at)), f"{probe.channel}\n{probe.angle_deg:g}°", **text)
        label = (labels or {}).get(node)
        panel.set_title(f"node {node}" + (f" ({label})" if label else ""))
    sense = "counter-clockwise" if conventions.sense > 0 else "clockwise"
    left = f"; {len(at) - MOST} more nodes" if len(at) > MOST else ""
    told = f"Seen as in the rig file: the shaft turns {sense}{left}"
    return finished(picture, fill(told, CHARACTERS * len(shown)))


def spread(directions):
    """Directions (rad) of labels, in the order given, moved apart where they would cover each other."""
    found = np.array(list(directions), float)
    for _ in range(SPREADS):
        order = np.argsort(found % (2 * np.pi), kind="stable")
        after = np.roll(order, -1)
        near = APART - (found[after] - found[order]) % (2 * np.pi)
        if len(found) < 2 or near.max() <= 0:
            break
        push = np.where(near > 0, near / 2 + TINY, 0.0)
        np.add.at(found, order, -push)
        np.add.at(found, after, push)
    return found


def _section(panel, conventions, mark):
    """Shaft with its mark as the mark passes its sensor, gravity, zero of the angles, sense of rotation."""
    from matplotlib.patches import Circle

    panel.add_patch(Circle((0, 0), 1, facecolor="0.9", edgecolor="0.4"))
    key = conventions.keyphasor
    sensor = _on_page(conventions, key.sensor_angle_deg)
    panel.plot(*(0.9 * _xy(sensor)), "s", color="k", markersize=6)
    panel.plot(*np.transpose([1.08 * _xy(sensor), PROBE * _xy(sensor)]), color="k", linewidth=3, solid_capstyle="butt")
    panel.text(*(LABEL * _xy(mark)), "phase\nmark", ha="center", va="center", fontsize=7, bbox=BLANK)
    line = _on_page(conventions, key.sensor_angle_deg - key.mark_angle_deg)
    panel.plot(*np.transpose([0 * _xy(line), 0.8 * _xy(line)]), ":", color="k", linewidth=1)
    side = -0.8 if np.sin(line - 0.8) > np.sin(line + 0.8) else 0.8  # away from the arrow of gravity
    panel.text(*(0.5 * _xy(line + side)), "reference\nline", ha="center", va="center", fontsize=6)
    panel.annotate("", (0, -0.75), (0, 0), arrowprops={"arrowstyle": "-|>", "color": "0.4"})
    panel.text(0.06, -0.55, "g", fontsize=8, color="0.3")
    turn = np.deg2rad(np.linspace(200, 250, 20))[:: conventions.sense]
    panel.plot(1.2 * np.cos(turn), 1.2 * np.sin(turn), color=COLOURS[2])
    panel.annotate("", 1.2 * _xy(turn[-1]), 1.2 * _xy(turn[-2]), arrowprops={"arrowstyle": "-|>", "color": COLOURS[2]})
    zero = _on_page(conventions, 0.0)
    panel.plot(*np.transpose([_xy(zero), 1.75 * _xy(zero)]), "--", color="0.6", linewidth=0.7, zorder=0)
    panel.text(*(2.2 * _xy(zero)), "0°", fontsize=7, color="0.4", ha="center", va="center")
    angles = [0.0, key.sensor_angle_deg, *(probe.angle_deg for probe in conventions.probes)]
    lowest = min(np.sin(_on_page(conventions, angle)) for angle in angles)
    panel.set(xlim=(-2.5, 2.5), ylim=(min(-1.4, 2.4 * lowest), 2.4))
    panel.set_aspect("equal")
    panel.axis("off")


def _on_page(conventions, angle_deg):
    """Direction on the page, rad from the right, of an angle of the rig file: gravity points down."""
    return np.deg2rad(angle_deg - conventions.gravity_angle_deg - 90)


def _xy(angle):
    return np.array([np.cos(angle), np.sin(angle)])
