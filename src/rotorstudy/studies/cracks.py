"""Every crack model of the zoo on one rotor, side by side, and every relation from crack depth to stiffness loss."""

from typing import Any

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.cracks import breathing_function
from rotorstudy.model.depth import stiffness_loss
from rotorstudy.model.options import check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model, named_plugins
from rotorstudy.presentation.plots import COLOURS, figure, plot_full_spectrum
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.store import as_complex, dataset, provenance, read_yaml
from rotorstudy.studies.config import SPEED, PositiveNumber, SpeedRange

DIRECTIONS = ("xi", "eta", "vertical", "horizontal")
STYLES = ("-", "--", "-.", ":")
LEAST = 1e-11  # m, shown in figures; no probe sees that


class Shaft(Strict):
    """The shaft on simple supports whose crack depths are turned into stiffness losses; k is 48 E I / L^3."""

    diameter_m: PositiveNumber
    span_m: PositiveNumber
    youngs_modulus_Pa: PositiveNumber = 2.1e11

    @property
    def stiffness(self):
        return 48 * self.youngs_modulus_Pa * np.pi / 64 * self.diameter_m**4 / self.span_m**3


class CracksConfig(Strict):
    """rotor, effects: as in a rig, one translation;  loss_share: of the shaft's stiffness that the open crack takes

    options : crack -> options other than those of its example;  angles : samples of a turn
    shown_speeds_rad_s : of the full spectra;  swept : of the vibration over speed;  shown_orders : drawn over speed
    """

    title: str
    rotor: dict[str, Any]
    effects: list[dict[str, Any]]
    loss_share: float = Field(gt=0, lt=1)
    options: dict[str, dict[str, Any]] = {}
    angles: int = Field(gt=8)
    harmonics: list[int] = Field(min_length=1)
    shown_speeds_rad_s: list[PositiveNumber] = Field(min_length=1)
    swept: SpeedRange
    shown_orders: list[int] = Field(min_length=1)
    shaft: Shaft

    @property
    def base(self):
        """The rig without a crack."""
        return {"rotor": self.rotor, "effects": self.effects}

    @property
    def shaft_stiffness(self):
        """N/m, of the uncracked rotor."""
        structure = build_model(self.base, where=self.title).structure
        if len(structure.dofs) > 1:
            raise RotorstudyError(
                f"{self.title}: crack models are compared on a rotor with one coordinate; '{self.rotor['kind']}' has "
                f"{len(structure.dofs)}"
            )
        return float(structure.stiffness[0, 0])

    def options_of(self, crack):
        """Options a crack is compared with: its example, or what the configuration says."""
        given = {**crack.example, **self.options.get(crack.name, {})}
        return check_options(crack.function, given, f"{self.title}, options of {crack.name}", ("angle",))

    def model(self, crack):
        """The rotor with one crack that acts on the whole motion (no weight dominance)."""
        loss = self.loss_share * self.shaft_stiffness
        item = {"kind": crack.name, "stiffness_loss_N_per_m": loss, "weight_dominance": False}
        cracked = {**self.base, "cracks": [{**item, **self.options_of(crack)}]}
        return build_model(cracked, where=f"{self.title}, {crack.name}")


def load_cracks(path):
    """The CracksConfig of a file, its options checked against the cracks there are."""
    config = check_config(CracksConfig, read_yaml(path), str(path))
    cracks = registry().plugins["crack"]
    for name in config.options:
        if name not in cracks:
            raise unknown_name("crack", name, cracks, f"options of {path}")
    for crack in cracks.values():
        config.options_of(crack)
    _ = config.shaft_stiffness  # the rotor is one that cracks can be compared on
    return config


def compare(config):
    """Every crack of the zoo on the same rotor with the same loss.

    returns : stiffness (crack, direction, shaft_angle) N/m; displacement (crack, speed, harmonic) and
              swept_displacement (crack, swept_speed, harmonic) m; mean_natural_frequency (crack) rad/s of the mean
              stiffness, natural_frequency rad/s of the sound rotor; depth_loss (depth, direction, depth_ratio) N/m
    """
    cracks, depths = (registry().plugins[kind] for kind in ("crack", "depth"))
    k, angle = config.shaft_stiffness, np.linspace(0, 2 * np.pi, config.angles)
    mass = float(build_model(config.base).structure.mass[0, 0])
    stiffness, shown, swept, mean = [], [], [], []
    for crack in cracks.values():
        model = config.model(crack)
        values = breathing_function(crack, angle, config.options_of(crack))
        stiffness.append(k * (1 - config.loss_share * _directions(values, angle)))
        mean.append(np.sqrt(stiffness[-1][:2, :-1].mean() / mass))
        shown.append(harmonic_response(model, config.shown_speeds_rad_s, config.harmonics)[..., 0])
        swept.append(harmonic_response(model, config.swept.speeds, config.harmonics)[..., 0])
    ratios = np.linspace(0, 1, 101)
    given = config.shaft.model_dump()
    losses = [
        [
            stiffness_loss(depth, r, config.shaft.stiffness, **given) if _within(depth, r) else (np.nan, np.nan)
            for r in ratios
        ]
        for depth in depths.values()
    ]
    coordinates = {
        "crack": (list(cracks), "1", "crack model"),
        "direction": (list(DIRECTIONS), "1", "turning with the shaft: xi, eta; standing still: vertical, horizontal"),
        "shaft_angle": (angle, "rad", "shaft angle, 0 where the crack edge points down"),
        "speed": (np.array(config.shown_speeds_rad_s), *SPEED),
        "swept_speed": (config.swept.speeds, *SPEED),
        "harmonic": (np.array(config.harmonics), "1", "harmonic of the spin speed, positive forward"),
        "depth": (list(depths), "1", "relation from crack depth to stiffness loss"),
        "turning": (["xi", "eta"], "1", "direction that turns with the shaft"),
        "depth_ratio": (ratios, "1", "crack depth over diameter"),
    }
    variables = {
        "stiffness": (("crack", "direction", "shaft_angle"), np.array(stiffness), "N/m", "stiffness at the disc"),
        "displacement": (("crack", "speed", "harmonic"), np.array(shown), "m", "full spectrum"),
        "swept_displacement": (("crack", "swept_speed", "harmonic"), np.array(swept), "m", "full spectrum over speed"),
        "mean_natural_frequency": (("crack",), np.array(mean), "rad/s", "natural frequency of the mean stiffness"),
        "natural_frequency": ((), np.sqrt(k / mass), "rad/s", "natural frequency of the sound rotor"),
        "depth_loss": (
            ("depth", "turning", "depth_ratio"),
            np.moveaxis(np.array(losses), -1, 1),
            "N/m",
            "stiffness loss of a shaft with crack and disc at mid-span",
        ),
    }
    used = [*named_plugins(config.base), *cracks.values(), *depths.values()]
    made = dataset(variables, coordinates, title=config.title)
    return made.assign_attrs(provenance(config.model_dump(), used))


def _directions(values, angle):
    """(direction, angle) shares of the loss along xi, eta, down and sideways."""
    xi, eta, both = values
    cosine, sine = np.cos(angle), np.sin(angle)
    down = xi * cosine**2 + eta * sine**2 - 2 * both * sine * cosine
    return np.array([xi, eta, down, xi + eta - down])


def _within(depth, ratio):
    return depth.valid[0] <= ratio <= depth.valid[1]


def _style(i):
    return {"color": COLOURS[i % len(COLOURS)], "linestyle": STYLES[i % len(STYLES)]}


def _name(plugin):
    return str(plugin).replace("_", " ")


def stiffness_figure(data):
    """Stiffness over the shaft angle in four directions."""
    picture, axes = figure(2, 2, height=2.1, sharex=True)
    titles = ("Turning: along the weak direction xi", "Turning: across it, eta", "Still: vertical", "Still: horizontal")
    for panel, direction, title in zip(axes.flat, DIRECTIONS, titles, strict=True):
        for i, crack in enumerate(data.crack.values):
            values = data.stiffness.sel(crack=crack, direction=direction)
            panel.plot(np.degrees(data.shaft_angle), values / 1e3, label=_name(crack), **_style(i))
        panel.set(title=title, ylabel="stiffness (kN/m)", xticks=range(0, 361, 90))
    for panel in axes[1]:
        panel.set_xlabel("shaft angle (°), 0: crack down")
    low, high = float(data.stiffness.min()) / 1e3, float(data.stiffness.max()) / 1e3
    for panel in axes.flat:
        panel.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    picture.suptitle("The same loss of the open crack, spread differently over a turn", fontsize=9)
    return picture


def spectra_figure(data):
    """Full spectra at the shown speeds, one panel a speed."""
    picture, axes = figure(data.sizes["speed"], 1, height=1.9, width=6.5, sharex=True)
    natural = float(data.natural_frequency)
    for panel, speed in zip(axes[:, 0], data.speed.values, strict=True):
        for i, crack in enumerate(data.crack.values):
            values = as_complex(data.displacement.sel(crack=crack, speed=speed))
            some = np.abs(values) > LEAST
            plot_full_spectrum(
                data.harmonic.values[some],
                values[some],
                panel,
                label=_name(crack),
                index=i,
                count=data.sizes["crack"],
            )
        panel.set_xticks(data.harmonic.values, [f"{n}X" for n in data.harmonic.values])
        panel.set(title=f"{speed:.0f} rad/s, {speed / natural:.2f} of the natural frequency", xlabel="")
    axes[-1, 0].set_xlabel("harmonic (backward < 0 < forward)")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    picture.suptitle("An open crack shows at 0X and 2X, one that breathes at every harmonic", fontsize=9)
    return picture


def sweep_figure(data, orders):
    """Amplitude of some harmonics over speed, with the natural frequency over the order."""
    picture, axes = figure(len(orders), 1, height=1.8, width=5.5, sharex=True)
    natural = float(data.natural_frequency)
    for panel, n in zip(axes[:, 0], orders, strict=True):
        for i, crack in enumerate(data.crack.values):
            height = np.abs(as_complex(data.swept_displacement.sel(crack=crack, harmonic=n)))
            if height.max() > LEAST:
                panel.semilogy(data.swept_speed / natural, height * 1e6, label=_name(crack), **_style(i))
        if data.swept_speed[0] < natural / n < data.swept_speed[-1]:
            panel.axvline(1 / n, color="k", linewidth=0.8, linestyle=":")
        panel.set(ylabel=f"{n}X (µm)")
    axes[0, 0].set_title("Dotted: natural frequency of the sound rotor over the order")
    axes[-1, 0].set_xlabel("speed over natural frequency of the sound rotor (1)")
    handles = {
        text: handle for panel in axes[:, 0] for handle, text in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    picture.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)
    picture.suptitle("Critical sub-speeds: nX peaks just below 1/n of the natural frequency", fontsize=9)
    return picture


def depth_figure(data, shaft):
    """Stiffness loss over crack depth."""
    picture, axes = figure(height=2.6, width=4.5)
    for i, depth in enumerate(data.depth.values):
        for turning, style in (("xi", "-"), ("eta", "--")):
            loss = data.depth_loss.sel(depth=depth, turning=turning) / shaft.stiffness * 100
            text = f"{_name(depth)}, {turning}"
            axes[0, 0].plot(data.depth_ratio, loss, style, color=COLOURS[i % len(COLOURS)], label=text)
    axes[0, 0].set(
        xlabel="crack depth over diameter (1)",
        ylabel="stiffness loss of the shaft (%)",
        xlim=(0, 0.02 + max(plugin.valid[1] for plugin in registry().plugins["depth"].values())),
        title=f"Crack and disc at mid-span, {shaft.diameter_m * 1e3:g} mm thick, {shaft.span_m * 1e3:g} mm long",
    )
    axes[0, 0].legend()
    picture.suptitle("A crack must be deep before the shaft feels it", fontsize=9)
    return picture
