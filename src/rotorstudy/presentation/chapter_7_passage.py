"""Figure of Chapter 7: the cracked rotor runs up through a half and a third of its critical speed."""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, figure


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
    for i, depth in enumerate(depths):
        axes[0, -1].plot(speed, passage.growth_rate.sel(depth_ratio=depth), color=COLOURS[i])
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
