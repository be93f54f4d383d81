"""Figures of Chapter 7: how small a crack is detected, and how accurately it is found."""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure
from rotorstudy.studies.crack_study.limits import detection_probability
from rotorstudy.units import number, percent

QUANTITIES = (
    ("depth_ratio", "depth (% of diameter)", 100.0),
    ("position_m", "position (% of length)", 100.0),
    ("angle_rad", "angle (°)", 180 / np.pi),
)
STYLES = {"none": ":", "healthy record": "-"}
BASELINE_TEXT = {"none": "rig file only", "healthy record": "with a healthy record"}
SHOWN_DEPTH = 0.12  # of the diameter, up to which the completeness is drawn


def _outline(panel, rotor, title):
    """Shaft, discs, bearings and probes of a rotor along an axis of position in m."""
    model = rotor.model()
    structure = model.structure
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


def smallest_crack(study, limits):
    """Smallest crack detected over the shaft of each rotor, with and without a record of the healthy machine."""
    picture, axes = figure(2, len(study.rotors), height=1.9, width=3.6, sharex="col", height_ratios=[3, 1])
    for (panel, below), (name, rotor) in zip(axes.T, study.rotors.items(), strict=True):
        called = name.replace("_", " ").capitalize()
        found = limits[f"smallest_depth_{name}"].sel(noise=study.usual_noise_percent) * 100
        for baseline, line in STYLES.items():
            panel.set_prop_cycle(color=COLOURS, marker=MARKERS)
            labels = list(rotor.planes) if baseline == "healthy record" else None
            values = found.sel(baseline=baseline).transpose(f"position_{name}", f"planes_{name}")
            panel.plot(limits[f"position_{name}"], values, linestyle=line, label=labels, markersize=2.5)
        title = f"{called}: solid {BASELINE_TEXT['healthy record']}, dotted without"
        panel.set(yscale="log", ylim=(1, 200), title=title)  # with room for the legend
        panel.set_yticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
        panel.legend(title="probes", fontsize=5.5, title_fontsize=6, ncols=2, loc="upper center")
        _outline(below, rotor, called)
    axes[0, 0].set_ylabel("smallest crack detected (% of diameter)")
    first = limits[f"smallest_depth_{next(iter(study.rotors))}"].sel(baseline="healthy record")
    best = 100 * float(first.sel(noise=study.usual_noise_percent).min())
    told = f"a crack of {best:.1f} % in the best place is detected ({percent(study.power)} of the time)"
    picture.suptitle(f"At {study.usual_noise_percent:g} % noise {told}")
    return picture


def completeness(study, limits):
    """Share of cracks anywhere on the shaft that are detected, over their depth."""
    name, rotor = next(iter(study.rotors.items()))
    seen = limits[f"visibility_{name}"].fillna(0.0)
    depths = np.geomspace(float(seen.depth_ratio.min()), SHOWN_DEPTH, 60)
    logs = np.log(np.maximum(seen.transpose(..., "depth_ratio").values, 1e-300))
    dims, known = seen.transpose(..., "depth_ratio").dims, np.log(seen.depth_ratio.values)
    fine = np.apply_along_axis(lambda row: np.interp(np.log(depths), known, row), -1, logs)
    detected = detection_probability(np.exp(fine), study.false_alarm)
    share = detected.mean(axis=dims.index(f"position_{name}"))  # (planes, noise, baseline, depth)
    usual = study.noise_percent.index(study.usual_noise_percent)
    picture, axes = figure(1, 2, height=2.6, sharey=True)
    last, noises = list(rotor.planes)[-1], [f"{level:g} % noise" for level in study.noise_percent]
    for panel, rows, labels in ((axes[0, 0], share[:, usual], list(rotor.planes)), (axes[0, 1], share[-1], noises)):
        for b, line in enumerate(STYLES.values()):
            panel.set_prop_cycle(color=COLOURS)
            panel.plot(depths * 100, rows[:, b].T, line, label=labels if line == "-" else None)
    axes[0, 0].set(ylabel="detected share of places", title=f"By probes, {study.usual_noise_percent:g} % noise")
    axes[0, 1].set(title=f"By noise, probes at {last}")
    for panel in axes[0]:
        panel.set(xlabel="depth (% of diameter)", ylim=(0, 1.02))
        panel.legend(fontsize=6, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.22))
    half = np.where((share[-1, usual] >= 0.5).any(axis=-1), depths[(share[-1, usual] >= 0.5).argmax(axis=-1)], np.nan)
    alone, healthy = (f"{100 * x:.2g} %" if np.isfinite(x) else "none shown" for x in half)
    picture.suptitle(
        f"Depth detected at half of the places, probes at {last}: {healthy} with a healthy record (solid), "
        f"{alone} by the rig file alone",
        fontsize=8,
    )
    return picture


def accuracy_over_the_shaft(study, accuracy):
    """Bounds of depth, position and angle over the shaft, for some depths."""
    length = study.main.model().structure.length
    planes = list(study.main.planes)[2 if len(study.main.planes) > 2 else -1]
    found = accuracy.bound.sel(planes=planes, noise=study.usual_noise_percent)
    picture, axes = figure(1, 3, height=2.5, width=2.6)
    depths = [f"{100 * depth:g} %" for depth in accuracy.depth_ratio.values]
    for panel, (name, text, factor) in zip(axes[0], QUANTITIES, strict=True):
        scale = factor / length if name == "position_m" else factor
        panel.set_prop_cycle(color=COLOURS, marker=MARKERS)
        panel.plot(accuracy.position, found.sel(shape=name) * scale, label=depths)
        panel.set(yscale="log", xlabel="position on the shaft (m)", title=text)
    axes[0, 0].set_ylabel("standard deviation (Cramér-Rao)")
    axes[0, 0].legend(title="depth", fontsize=6, title_fontsize=6)
    place = found.sel(shape="position_m", depth_ratio=float(accuracy.depth_ratio[-1]))
    times, worst = number(float(place.max() / place.min()), 2), float(accuracy.position[np.argmax(place.values)])
    picture.suptitle(
        f"At {worst * 1e3:.0f} mm the place of a crack of {100 * float(place.depth_ratio):g} % is {times} times "
        f"less certain than at best (probes at {planes})"
    )
    return picture


def noise_and_probes(study, accuracy):
    """Bounds of depth and position at mid-shaft over the noise, for all sets of probes."""
    length = study.main.model().structure.length
    middle = float(accuracy.position[len(accuracy.position) // 2])
    depth = float(accuracy.depth_ratio[np.argmin(np.abs(accuracy.depth_ratio.values - study.reference.depth_ratio))])
    picture, axes = figure(1, 2, height=2.5)
    for panel, (name, text, factor) in zip(axes[0], QUANTITIES[:2], strict=True):
        scale = factor / length if name == "position_m" else factor
        panel.set_prop_cycle(color=COLOURS, marker=MARKERS)
        values = accuracy.bound.sel(shape=name, depth_ratio=depth, position=middle).T * scale
        panel.loglog(accuracy.noise, values, label=list(accuracy.planes.values))
        panel.set(xlabel="noise (% of the rms vibration)", title=text)
        panel.set_xticks(accuracy.noise.values, [f"{x:g}" for x in accuracy.noise.values])
    axes[0, 0].set_ylabel("standard deviation (Cramér-Rao)")
    lines = axes[0, 0].get_legend_handles_labels()
    picture.legend(*lines, loc="outside lower center", ncols=5, fontsize=6, title="probes", title_fontsize=6)
    planes = list(study.main.planes)
    there = accuracy.bound.sel(shape="depth_ratio", depth_ratio=depth)
    there = there.sel(position=middle, noise=study.usual_noise_percent)
    picture.suptitle(
        f"Crack of {100 * depth:g} % at {middle * 1e3:.0f} mm, {study.usual_noise_percent:g} % noise: the depth is "
        f"{float(there[0] / there[-1]):.1f} times more certain by {planes[-1]} than by {planes[0]}",
        fontsize=8,
    )
    return picture


def _bars(panel, ratio, names, along="x"):
    """Bars of each quantity beside each other; ratio : (name, shape)"""
    width, draw = 0.8 / len(QUANTITIES), panel.bar if along == "x" else panel.barh
    for i, (name, text, _) in enumerate(QUANTITIES):
        draw(np.arange(len(names)) + (i - 1) * width, ratio.sel(shape=name), width, label=text.split(" (")[0])
    (panel.set_xticks if along == "x" else panel.set_yticks)(range(len(names)), names)
    panel.legend(fontsize=6)


def information(study, accuracy):
    """What the harmonics and the speeds tell of the reference crack."""
    picture, axes = figure(1, 2, height=2.6)
    shapes, best = [name for name, *_ in QUANTITIES], accuracy.bound_of_reference
    _bars(axes[0, 0], accuracy.bound_by_harmonic / best, [str(name) for name in accuracy.harmonic_group.values])
    axes[0, 0].tick_params("x", rotation=45)
    for variable, line in (("bound_by_speed", "o"), ("bound_by_speeds", "-")):
        axes[0, 1].set_prop_cycle(color=COLOURS)
        axes[0, 1].plot(accuracy.speed, (accuracy[variable] / best).sel(shape=shapes), line)
    axes[0, 0].set(yscale="log", ylabel="standard deviation over that of all (1)", title="Some harmonics alone")
    axes[0, 1].set(yscale="log", xlabel="speed (rad/s)", title="One speed alone (dots), all up to it (lines)")
    without = float((accuracy.bound_by_harmonic / best).sel(harmonic_group="without 1X", shape="depth_ratio"))
    picture.suptitle(f"The crack shows in all harmonics: without 1X its depth is {without:.1f} times less accurate")
    return picture


def trade_offs(study, accuracy):
    """How much less accurate the reference crack is if another effect may be present."""
    names = [str(name) for name in accuracy.confounder.values]
    picture, axes = figure(1, 1, height=2.6, width=4.5)
    _bars(axes[0, 0], accuracy.bound_with / accuracy.bound_of_reference - 1, names, along="y")
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(xlabel="increase of the standard deviation (1)")
    worst = int(np.argmax(accuracy.bound_with.sel(shape="depth_ratio").values))
    picture.suptitle(f"The depth trades off most against {names[worst]}")
    return picture


def noisy_records(study, trials):
    """Errors of identified cracks over their Cramér-Rao bound, and the coverage of the stated intervals."""
    picture, axes = figure(1, len(QUANTITIES), height=2.4, width=2.6, sharey=True)
    held = (np.abs(trials.error) <= 1.96 * trials.stated_std).mean().item()
    for panel, (name, text, _) in zip(axes[0], QUANTITIES, strict=True):
        for i, depth in enumerate(trials.depth_ratio.values):
            error = trials.error.sel(shape=name, depth_ratio=depth) / trials.bound.sel(shape=name, depth_ratio=depth)
            offset = np.linspace(-0.25, 0.25, len(error))
            panel.plot(i + offset, error, ".", color=COLOURS[i])
            panel.plot([i - 0.3, i + 0.3], [float(np.sqrt((error**2).mean()))] * 2, color="k")
        panel.axhspan(-1.96, 1.96, color="0.9", zorder=0)
        panel.set_xticks(range(len(trials.depth_ratio)), [f"{100 * d:g} %" for d in trials.depth_ratio.values])
        panel.set(xlabel="depth of the crack", title=text.split(" (")[0])
    axes[0, 0].set_ylabel("error over the bound (bar: rms)")
    count = trials.error.size
    picture.suptitle(f"{percent(held, 2)} of {count} stated 95 % intervals hold the truth (grey: 95 % by the bound)")
    return picture


def curved_fronts(study, fronts):
    """Depths found of cracks with curved fronts over the true ones, by each law of flexibility."""
    picture, axes = figure(1, len(fronts.law), height=2.5, width=2.0, sharey=True)
    ends, bias = np.array(study.fronts.depth_ratios) * 100, {}
    for panel, law in zip(axes[0], fronts.law.values, strict=True):
        one, true = fronts.sel(law=law), fronts.depth_ratio * 100
        shown = panel.scatter(true, one.found * 100, c=fronts.curvature, cmap="viridis", s=9, zorder=3)
        panel.vlines(true, one.low * 100, one.high * 100, color="0.7", linewidth=0.7)
        panel.plot(ends, ends, "k-", linewidth=0.7)
        held = float(((one.low <= fronts.depth_ratio) & (fronts.depth_ratio <= one.high)).mean())
        bias[law] = float((one.found / fronts.depth_ratio - 1).median())
        title = f"{law}: median {100 * bias[law]:+.0f} %,\n{percent(held)} held"
        panel.set(xlabel="true depth (% of diameter)", title=title)
        panel.set_ylim(0, 1.3 * ends[1])
    axes[0, 0].set_ylabel("depth found")
    picture.colorbar(shown, ax=axes[0, -1], label="depth over radius of the front")
    last = str(fronts.law.values[-1])
    told = f"with the {last} the median depth is off by {100 * bias[last]:+.1f} %"
    picture.suptitle(f"{fronts.sizes['trial']} cracks by three-dimensional elasticity: {told}")
    return picture


def thesis_method_figure(study, thesis):
    """The stiffness loss that the thesis's method finds for the same crack at other places."""
    node = study.thesis.cracks[0]["node"]
    picture, axes = figure(1, 1, height=2.5, width=4.2)
    axes[0, 0].plot(thesis.position, thesis.loss / 1e3, "o-", color=COLOURS[0])
    axes[0, 0].axvline(study.reference.position_m, color="0.5", linewidth=0.8)
    axes[0, 0].axhline(0, color="k", linewidth=0.6)
    axes[0, 0].set(xlabel="true position of the crack (m)", ylabel="stiffness loss found (N/mm)")
    picture.suptitle(
        f"Least squares with a crack at node {node}: the loss found for a crack of\n"
        f"{100 * study.thesis.depth_ratio:g} % of the diameter depends on its place"
    )
    return picture


def passage_figure(study, passage):
    """Harmonics over speed, by depth, with the fractions of the critical speeds at which each resonates."""
    orders, depths = passage.order.values, passage.depth_ratio.values
    picture, axes = figure(1, len(orders) + 1, height=2.4, width=2.0)
    speed = passage.speed.values
    for panel, order in zip(axes[0], orders, strict=False):
        for critical in passage.critical_speed.values:
            panel.axvline(critical / order, color="0.7", linestyle=":", linewidth=0.9)
        for i, depth in enumerate(depths):
            if depth or order == 1:
                values = passage.amplitude.sel(depth_ratio=depth, order=order) * 1e6
                panel.semilogy(speed, values, color=COLOURS[i], label=f"{100 * depth:g} %")
        panel.set(xlabel="speed (rad/s)", title=f"{order}X")
    axes[0, 0].set_ylabel(f"major semi-axis at node {study.passage.node} (µm)")
    axes[0, 0].legend(title="crack", fontsize=6, title_fontsize=6)
    axes[0, -1].plot(speed, passage.growth_rate.transpose("speed", "depth_ratio"))
    axes[0, -1].axhline(0, color="k", linewidth=0.6)
    axes[0, -1].set(xlabel="speed (rad/s)", ylabel="growth rate (1/s)", title="free motion")
    picture.suptitle(_message(passage))
    return picture


def _message(passage):
    """Where 2X of the deepest crack peaks, and whether its free motion grows anywhere."""
    deepest = passage.isel(depth_ratio=-1)
    twice = deepest.amplitude.sel(order=2).dropna("speed")
    peak, grows = float(twice.speed[int(np.argmax(twice.values))]), bool((deepest.growth_rate > 0).any())
    critical = passage.critical_speed.values[np.argmin(np.abs(passage.critical_speed.values / 2 - peak))]
    motion = "grows at some speeds" if grows else "decays at all speeds"
    return (
        f"2X of a crack of {100 * float(deepest.depth_ratio):g} % peaks at {peak:.0f} rad/s, {peak / critical:.2f} of "
        f"a critical speed;\nits free motion {motion} (dotted: critical speeds over the order)"
    )


def figures(study, limits, accuracy, trials, fronts, passage, thesis_method):
    """The figures of the study, from the Datasets of its stages."""
    return {
        "smallest_crack": smallest_crack(study, limits),
        "completeness": completeness(study, limits),
        "accuracy_over_the_shaft": accuracy_over_the_shaft(study, accuracy),
        "noise_and_probes": noise_and_probes(study, accuracy),
        "information": information(study, accuracy),
        "trade_offs": trade_offs(study, accuracy),
        "noisy_records": noisy_records(study, trials),
        "curved_fronts": curved_fronts(study, fronts),
        "passage": passage_figure(study, passage),
        "thesis_method": thesis_method_figure(study, thesis_method),
    }
