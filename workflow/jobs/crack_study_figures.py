"""Figures of Chapter 7: how small a crack is detected, and how accurately it is found.

Each is of the configuration of the study and of Datasets of its stages.
"""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, curves, figure, finished
from rotorstudy.studies.crack_study.stages import detection_probability
from rotorstudy.units import number, percent

QUANTITIES = (
    ("depth_ratio", "depth (% of diameter)", 100.0),
    ("position_m", "position (% of length)", 100.0),
    ("angle_rad", "angle (°)", 180 / np.pi),
)
NAMES = [text.split(" (")[0] for _, text, _ in QUANTITIES]
STYLES = {"none": ":", "healthy record": "-"}
SHOWN_DEPTH = 0.12  # of the diameter, up to which the completeness is drawn
SMALL = {"fontsize": 6, "title_fontsize": 6}  # of a legend in a panel


def _shares(depths):
    return [f"{100 * depth:g} %" for depth in depths]


def _marked(i):
    return {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}


def _outline(panel, rotor, title):
    """Shaft, discs, bearings and probes of a rotor along an axis of position in m."""
    structure = rotor.model().structure
    at = list(structure.node_positions.values())
    grid = np.linspace(0, structure.length, 300)
    radius = np.array([structure.section_at(s).outer_diameter_m for s in grid]) / 2
    panel.fill_between(grid, -radius, radius, color="0.75", linewidth=0)
    size = radius.max()
    for disc in rotor.rotor.get("discs", []):
        panel.plot([at[disc["node"] - 1]] * 2, [-2.5 * size, 2.5 * size], color="0.35", linewidth=3)
    for bearing in rotor.bearings:
        panel.plot(at[bearing["node"] - 1], -2.2 * size, "^", color="k", markersize=6)
    panel.set(yticks=[], xlabel=f"position on the shaft (m), {title}", ylim=(-3.2 * size, 3.2 * size))
    panel.grid(visible=False)


def smallest_crack(config, limits):
    """Smallest crack detected over the shaft of each rotor, with and without a record of the healthy machine."""
    picture, axes = figure(2, len(config.rotors), height=1.9, width=3.6, sharex="col", height_ratios=[3, 1])
    usual = config.usual_noise_percent
    for (panel, below), (name, rotor) in zip(axes.T, config.rotors.items(), strict=True):
        called = name.replace("_", " ").capitalize()
        found, position = limits[f"smallest_depth_{name}"].sel(noise=usual) * 100, limits[f"position_{name}"]
        for baseline, line in STYLES.items():
            known = {} if line == "-" else {"label": None}
            options = {"linestyle": line, "markersize": 2.5, **known}
            curves(panel, found.sel(baseline=baseline), position, f"planes_{name}", _marked, **options)
        title = f"{called}: solid with a healthy record, dotted without"
        panel.set(yscale="log", ylim=(1, 200), title=title)  # with room for the legend
        panel.set_yticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
        panel.legend(title="probes", fontsize=5.5, title_fontsize=6, ncols=2, loc="upper center")
        _outline(below, rotor, called)
    axes[0, 0].set_ylabel("smallest crack detected (% of diameter)")
    first = limits[f"smallest_depth_{next(iter(config.rotors))}"].sel(baseline="healthy record", noise=usual)
    told = f"a crack of {100 * float(first.min()):.1f} % in the best place is detected"
    return finished(picture, f"At {usual:g} % noise {told} ({percent(config.power)} of the time)")


def completeness(config, limits):
    """Share of cracks anywhere on the shaft that are detected, over their depth."""
    name, rotor = next(iter(config.rotors.items()))
    seen = limits[f"visibility_{name}"].fillna(0.0).transpose(..., "depth_ratio")
    known, depths = seen.depth_ratio.values, np.geomspace(float(seen.depth_ratio.min()), SHOWN_DEPTH, 60)
    logs = np.log(np.maximum(seen.values, 1e-300))
    fine = np.apply_along_axis(lambda row: np.interp(np.log(depths), np.log(known), row), -1, logs)
    detected = detection_probability(np.exp(fine), config.false_alarm)
    share = detected.mean(axis=seen.dims.index(f"position_{name}"))  # (planes, noise, baseline, depth)
    usual, last = config.noise_percent.index(config.usual_noise_percent), list(rotor.planes)[-1]
    picture, axes = figure(1, 2, height=2.6, sharey=True)
    for panel, rows, labels, title in (
        (axes[0, 0], share[:, usual], list(rotor.planes), f"By probes, {config.usual_noise_percent:g} % noise"),
        (axes[0, 1], share[-1], [f"{n:g} % noise" for n in config.noise_percent], f"By noise, probes at {last}"),
    ):
        for b, line in enumerate(STYLES.values()):
            panel.set_prop_cycle(color=COLOURS)
            panel.plot(depths * 100, rows[:, b].T, line, label=labels if line == "-" else None)
        panel.set(title=title, xlabel="depth (% of diameter)", ylim=(0, 1.02))
        panel.legend(fontsize=6, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.22))
    axes[0, 0].set_ylabel("detected share of places")
    half = np.where((share[-1, usual] >= 0.5).any(axis=-1), depths[(share[-1, usual] >= 0.5).argmax(axis=-1)], np.nan)
    alone, healthy = (f"{100 * x:.2g} %" if np.isfinite(x) else "none shown" for x in half)
    told = f"Depth detected at half of the places, probes at {last}: {healthy} with a healthy record (solid), "
    return finished(picture, f"{told}{alone} by the rig file alone", size=8)


def accuracy_over_the_shaft(config, accuracy):
    """Bounds of depth, position and angle over the shaft, for some depths."""
    length, planes = config.main.model().structure.length, list(config.main.planes)
    planes = planes[2 if len(planes) > 2 else -1]
    found = accuracy.bound.sel(planes=planes, noise=config.usual_noise_percent)
    picture, axes = figure(1, 3, height=2.5, width=2.6)
    for panel, (name, text, factor) in zip(axes[0], QUANTITIES, strict=True):
        scale = factor / length if name == "position_m" else factor
        panel.set_prop_cycle(color=COLOURS, marker=MARKERS)
        panel.plot(accuracy.position, found.sel(shape=name) * scale, label=_shares(accuracy.depth_ratio.values))
        panel.set(yscale="log", xlabel="position on the shaft (m)", title=text)
    axes[0, 0].set_ylabel("standard deviation (Cramér-Rao)")
    axes[0, 0].legend(title="depth", **SMALL)
    place = found.sel(shape="position_m").isel(depth_ratio=-1)
    times, worst = number(float(place.max() / place.min()), 2), float(accuracy.position[np.argmax(place.values)])
    told = f"At {worst * 1e3:.0f} mm the place of a crack of {100 * float(place.depth_ratio):g} % is {times} times"
    return finished(picture, f"{told} less certain than at best (probes at {planes})")


def noise_and_probes(config, accuracy):
    """Bounds of depth and position at mid-shaft over the noise, for all sets of probes."""
    length, noise = config.main.model().structure.length, accuracy.noise.values
    middle = float(accuracy.position[len(accuracy.position) // 2])
    depth = float(accuracy.depth_ratio[np.argmin(np.abs(accuracy.depth_ratio.values - config.reference.depth_ratio))])
    there = accuracy.bound.sel(depth_ratio=depth, position=middle)
    picture, axes = figure(1, 2, height=2.5)
    for panel, (name, text, factor) in zip(axes[0], QUANTITIES[:2], strict=True):
        scale = factor / length if name == "position_m" else factor
        curves(panel, there.sel(shape=name) * scale, noise, "planes", _marked)
        panel.set(xscale="log", yscale="log", xlabel="noise (% of the rms vibration)", title=text)
        panel.set_xticks(noise, [f"{x:g}" for x in noise])
    axes[0, 0].set_ylabel("standard deviation (Cramér-Rao)")
    planes, usual = list(config.main.planes), config.usual_noise_percent
    by_planes = there.sel(shape="depth_ratio", noise=usual)
    told = f"Crack of {100 * depth:g} % at {middle * 1e3:.0f} mm, {usual:g} % noise: the depth is "
    told += f"{float(by_planes[0] / by_planes[-1]):.1f} times more certain by {planes[-1]} than by {planes[0]}"
    return finished(picture, told, legend=5, size=8, title="probes", **SMALL)


def _bars(panel, ratio, names, along="x"):
    """Bars of each quantity beside each other; ratio : (name, shape)"""
    width, draw = 0.8 / len(QUANTITIES), panel.bar if along == "x" else panel.barh
    for i, (name, *_) in enumerate(QUANTITIES):
        draw(np.arange(len(names)) + (i - 1) * width, ratio.sel(shape=name), width, label=NAMES[i])
    (panel.set_xticks if along == "x" else panel.set_yticks)(range(len(names)), names)
    panel.legend(fontsize=6)


def information(accuracy):
    """What the harmonics and the speeds tell of the reference crack."""
    picture, axes = figure(1, 2, height=2.6)
    best, (left, right) = accuracy.bound_of_reference, axes[0]
    by_harmonic = accuracy.bound_by_harmonic / best
    _bars(left, by_harmonic, [str(name) for name in accuracy.harmonic_group.values])
    left.tick_params("x", rotation=45)
    for variable, line in (("bound_by_speed", "o"), ("bound_by_speeds", "-")):
        right.set_prop_cycle(color=COLOURS)
        right.plot(accuracy.speed, (accuracy[variable] / best).sel(shape=[name for name, *_ in QUANTITIES]), line)
    left.set(yscale="log", ylabel="standard deviation over that of all (1)", title="Some harmonics alone")
    right.set(yscale="log", xlabel="speed (rad/s)", title="One speed alone (dots), all up to it (lines)")
    times = float(by_harmonic.sel(harmonic_group="without 1X", shape="depth_ratio"))
    return finished(
        picture, f"The crack shows in all harmonics: without 1X its depth is {times:.1f} times less accurate"
    )


def trade_offs(accuracy):
    """How much less accurate the reference crack is if another effect may be present."""
    names = [str(name) for name in accuracy.confounder.values]
    picture, axes = figure(height=2.6, width=4.5)
    _bars(axes[0, 0], accuracy.bound_with / accuracy.bound_of_reference - 1, names, along="y")
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(xlabel="increase of the standard deviation (1)")
    worst = int(np.argmax(accuracy.bound_with.sel(shape="depth_ratio").values))
    return finished(picture, f"The depth trades off most against {names[worst]}")


def noisy_records(trials):
    """Errors of identified cracks over their Cramér-Rao bound, and the coverage of the stated intervals."""
    picture, axes = figure(1, len(QUANTITIES), height=2.4, width=2.6, sharey=True)
    for panel, (name, *_), quantity in zip(axes[0], QUANTITIES, NAMES, strict=True):
        for i, error in enumerate((trials.error / trials.bound).sel(shape=name).transpose("depth_ratio", "trial")):
            panel.plot(i + np.linspace(-0.25, 0.25, len(error)), error, ".", color=COLOURS[i])
            panel.plot([i - 0.3, i + 0.3], [float(np.sqrt((error**2).mean()))] * 2, color="k")
        panel.axhspan(-1.96, 1.96, color="0.9", zorder=0)
        panel.set_xticks(range(len(trials.depth_ratio)), _shares(trials.depth_ratio.values))
        panel.set(xlabel="depth of the crack", title=quantity)
    axes[0, 0].set_ylabel("error over the bound (bar: rms)")
    held = percent((np.abs(trials.error) <= 1.96 * trials.stated_std).mean().item(), 2)
    return finished(
        picture, f"{held} of {trials.error.size} stated 95 % intervals hold the truth (grey: 95 % by the bound)"
    )


def curved_fronts(config, fronts):
    """Depths found of cracks with curved fronts over the true ones, by each law of flexibility."""
    picture, axes = figure(1, len(fronts.law), height=2.5, width=2.0, sharey=True)
    ends, true = np.array(config.fronts.depth_ratios) * 100, fronts.depth_ratio * 100
    for panel, law in zip(axes[0], fronts.law.values, strict=True):
        one = fronts.sel(law=law)
        shown = panel.scatter(true, one.found * 100, c=fronts.curvature, cmap="viridis", s=9, zorder=3)
        panel.vlines(true, one.low * 100, one.high * 100, color="0.7", linewidth=0.7)
        panel.plot(ends, ends, "k-", linewidth=0.7)
        held = float(((one.low <= fronts.depth_ratio) & (fronts.depth_ratio <= one.high)).mean())
        bias = 100 * float((one.found / fronts.depth_ratio - 1).median())
        title = f"{law}: median {bias:+.0f} %,\n{percent(held)} held"
        panel.set(xlabel="true depth (% of diameter)", title=title, ylim=(0, 1.3 * ends[1]))
    axes[0, 0].set_ylabel("depth found")
    picture.colorbar(shown, ax=axes[0, -1], label="depth over radius of the front")
    told = f"with the {law} the median depth is off by {bias:+.1f} %"
    return finished(picture, f"{fronts.sizes['trial']} cracks by three-dimensional elasticity: {told}")


def thesis_method(config, thesis_method):
    """The stiffness loss that the thesis's method finds for the same crack at other places."""
    settings, (picture, axes) = config.thesis, figure(height=2.5, width=4.2)
    axes[0, 0].plot(thesis_method.position, thesis_method.loss / 1e3, "o-", color=COLOURS[0])
    axes[0, 0].axvline(config.reference.position_m, color="0.5", linewidth=0.8)
    axes[0, 0].axhline(0, color="k", linewidth=0.6)
    axes[0, 0].set(xlabel="true position of the crack (m)", ylabel="stiffness loss found (N/mm)")
    told = f"Least squares with a crack at node {settings.cracks[0]['node']}: the loss found for a crack of\n"
    return finished(picture, f"{told}{100 * settings.depth_ratio:g} % of the diameter depends on its place")


def passage(config, passage):
    """Harmonics over speed, by depth, with the fractions of the critical speeds at which each resonates."""
    picture, axes = figure(1, len(passage.order) + 1, height=2.4, width=2.0)
    speed, depths, criticals = passage.speed.values, passage.depth_ratio.values, passage.critical_speed.values
    for panel, order in zip(axes[0], passage.order.values, strict=False):
        for critical in criticals:
            panel.axvline(critical / order, color="0.7", linestyle=":", linewidth=0.9)
        for i, (depth, share) in enumerate(zip(depths, _shares(depths), strict=True)):
            if depth or order == 1:
                values = passage.amplitude.sel(depth_ratio=depth, order=order) * 1e6
                panel.semilogy(speed, values, color=COLOURS[i], label=share)
        panel.set(xlabel="speed (rad/s)", title=f"{order}X")
    axes[0, 0].set_ylabel(f"major semi-axis at node {config.passage.node} (µm)")
    axes[0, 0].legend(title="crack", **SMALL)
    axes[0, -1].plot(speed, passage.growth_rate.transpose("speed", "depth_ratio"))
    axes[0, -1].axhline(0, color="k", linewidth=0.6)
    axes[0, -1].set(xlabel="speed (rad/s)", ylabel="growth rate (1/s)", title="free motion")
    deepest = passage.isel(depth_ratio=-1)
    twice = deepest.amplitude.sel(order=2).dropna("speed")
    peak = float(twice.speed[int(np.argmax(twice.values))])
    share = peak / criticals[np.argmin(np.abs(criticals / 2 - peak))]
    motion = "grows at some speeds" if (deepest.growth_rate > 0).any() else "decays at all speeds"
    told = (
        f"2X of a crack of {100 * float(deepest.depth_ratio):g} % peaks at {peak:.0f} rad/s, {share:.2f} of a critical"
    )
    return finished(picture, f"{told} speed;\nits free motion {motion} (dotted: critical speeds over the order)")
