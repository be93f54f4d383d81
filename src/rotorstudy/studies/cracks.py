"""Every crack model of the plugin library on one rotor, and every relation from crack depth to stiffness loss."""

from typing import Any

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.cracks import breathing_function, stiffness_loss
from rotorstudy.model.options import check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.store import dataset
from rotorstudy.studies.common import HARMONIC, SPEED
from rotorstudy.studies.config import PositiveNumber, SpeedRange
from rotorstudy.yaml_file import read_yaml

DIRECTIONS = ("xi", "eta", "vertical", "horizontal")


class Shaft(Strict):
    """The simply supported shaft for the relations from crack depth to stiffness loss."""

    diameter_m: PositiveNumber
    span_m: PositiveNumber
    youngs_modulus_Pa: PositiveNumber = 2.1e11

    @property
    def stiffness(self):
        """48 E I / L^3 at mid-span, N/m."""
        return 48 * self.youngs_modulus_Pa * np.pi / 64 * self.diameter_m**4 / self.span_m**3


class CracksConfig(Strict):
    """rotor, effects : as in a rig, one coordinate;  loss_share : relative stiffness loss of the open crack"""

    title: str
    rotor: dict[str, Any]
    effects: list[dict[str, Any]]
    loss_share: float = Field(gt=0, lt=1)
    options: dict[str, dict[str, Any]] = {}  # crack -> options other than those of its example
    angles: int = Field(gt=8)  # samples per revolution
    harmonics: list[int] = Field(min_length=1)
    shown_speeds_rad_s: list[PositiveNumber] = Field(min_length=1)  # of the full spectra
    swept: SpeedRange  # speeds of the sweep
    shown_orders: list[int] = Field(min_length=1)  # harmonics of the sweep
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
        """Options of a crack in the comparison: those of the configuration, else of its example."""
        given = {**crack.example, **self.options.get(crack.name, {})}
        return check_options(crack.function, given, f"{self.title}, options of {crack.name}", ("angle",))

    def model(self, crack):
        """The rotor with one crack that acts on the whole motion (no weight dominance)."""
        loss = self.loss_share * self.shaft_stiffness
        item = {"kind": crack.name, "stiffness_loss_N_per_m": loss, "weight_dominance": False}
        cracked = {**self.base, "cracks": [{**item, **self.options_of(crack)}]}
        return build_model(cracked, where=f"{self.title}, {crack.name}")


def load_cracks(path):
    """The CracksConfig of a file, its options checked against the registered cracks."""
    config = check_config(CracksConfig, read_yaml(path), str(path))
    cracks = registry().plugins["crack"]
    check_known("crack", config.options, cracks, f"options of {path}")
    for crack in cracks.values():
        config.options_of(crack)
    _ = config.shaft_stiffness  # raises for a rotor with several coordinates
    return config


def compare(config):
    """A Dataset of every crack of the plugin library on one rotor with one loss, and of every depth relation."""
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
    losses = [[_loss(config.shaft, depth, ratio) for ratio in ratios] for depth in depths.values()]
    losses, of_depth = np.moveaxis(np.array(losses), -1, 1), ("depth", "turning", "depth_ratio")
    coordinates = {
        "crack": (list(cracks), "1", "crack model"),
        "direction": (list(DIRECTIONS), "1", "rotating with the shaft: xi, eta; fixed: vertical, horizontal"),
        "shaft_angle": (angle, "rad", "shaft angle, 0 where the crack edge points down"),
        "speed": (np.array(config.shown_speeds_rad_s), *SPEED),
        "swept_speed": (config.swept.speeds, *SPEED),
        "harmonic": (np.array(config.harmonics), *HARMONIC),
        "depth": (list(depths), "1", "relation from crack depth to stiffness loss"),
        "turning": (["xi", "eta"], "1", "direction that rotates with the shaft"),
        "depth_ratio": (ratios, "1", "crack depth over diameter"),
    }
    variables = {
        "stiffness": (("crack", "direction", "shaft_angle"), np.array(stiffness), "N/m", "stiffness at the disc"),
        "displacement": (("crack", "speed", "harmonic"), np.array(shown), "m", "full spectrum"),
        "swept_displacement": (("crack", "swept_speed", "harmonic"), np.array(swept), "m", "full spectrum over speed"),
        "mean_natural_frequency": (("crack",), np.array(mean), "rad/s", "natural frequency of the mean stiffness"),
        "natural_frequency": ((), np.sqrt(k / mass), "rad/s", "natural frequency of the uncracked rotor"),
        "depth_loss": (of_depth, losses, "N/m", "stiffness loss of a shaft with crack and disc at mid-span"),
    }
    return dataset(variables, coordinates, title=config.title)


def _directions(values, angle):
    """(direction, angle) shares of the loss along xi, eta, vertical and horizontal."""
    xi, eta, both = values
    cosine, sine = np.cos(angle), np.sin(angle)
    down = xi * cosine**2 + eta * sine**2 - 2 * both * sine * cosine
    return np.array([xi, eta, down, xi + eta - down])


def _loss(shaft, depth, ratio):
    """Loss along xi and eta, N/m, at a crack depth over diameter; NaN where the relation does not hold."""
    if not depth.valid[0] <= ratio <= depth.valid[1]:
        return np.nan, np.nan
    return stiffness_loss(depth, ratio, shaft.stiffness, **shaft.model_dump())
