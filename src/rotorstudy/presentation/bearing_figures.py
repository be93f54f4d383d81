"""Figure of the bearings of the plugin library."""

from rotorstudy.presentation.plots import COLOURS, figure
from rotorstudy.studies.bearings import DIRECTIONS

LINES = ("-", "-.", ":", "--")  # distinguishable where they coincide


def plot_bearing_coefficients(data):
    """A figure with a row for each bearing: stiffness in MN/m and damping in kN s/m over speed."""
    names = data.bearing.values
    picture, axes = figure(rows=len(names), columns=2, height=1.6, sharex=True)
    for row, name in zip(axes, names, strict=True):
        for panel, (quantity, scale, unit) in zip(
            row, (("stiffness", 1e-6, "MN/m"), ("damping", 1e-3, "kN s/m")), strict=True
        ):
            for d, direction in enumerate(DIRECTIONS):
                values = data[quantity].sel(bearing=name, direction=direction) * scale
                panel.plot(data.speed, values, LINES[d], color=COLOURS[d], label=direction)
            panel.set(ylabel=f"{quantity} ({unit})", title=name.replace("_", " "))
    for panel in axes[-1]:
        panel.set_xlabel("spin speed (rad/s)")
    picture.suptitle("Coefficients of every bearing plugin: only some depend on the speed")
    picture.align_ylabels()
    lines = axes[0, 0].get_legend_handles_labels()
    picture.legend(*lines, loc="outside lower center", ncols=4, title="force along, motion along; x down, at 1X")
    return picture
