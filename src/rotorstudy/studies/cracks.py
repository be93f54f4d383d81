"""Every crack model of the plugin library on one rotor, and every relation from crack depth to stiffness loss."""

from typing import Any

import numpy as np
from pydantic import Field

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.cracks import breathing_function, stiffness_loss
from rotorstudy.model.options import Positive, check_options
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.studies.common import results
from rotorstudy.studies.config import SpeedRange
from rotorstudy.yaml_file import read_yaml

DIRECTIONS = ("xi", "eta", "vertical", "horizontal")


class Shaft(Strict):
    """The simply supported shaft for the relations from crack depth to stiffness loss."""

    diameter_m: Positive
    span_m: Positive
    youngs_modulus_Pa: Positive = 2.1e11

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
    shown_speeds_rad_s: list[Positive] = Field(min_length=1)  # of the full spectra
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
    mass, ratios = float(build_model(config.base).structure.mass[0, 0]), np.linspace(0, 1, 101)

    def at(name):
        crack = cracks[name]
        shares = _directions(breathing_function(crack, angle, config.options_of(crack)), angle)
        stiffness, model = k * (1 - config.loss_share * shares), config.model(crack)
        both = (config.shown_speeds_rad_s, config.swept.speeds)
        shown, swept = (harmonic_response(model, speeds, config.harmonics)[..., 0] for speeds in both)
        mean = np.sqrt(stiffness[:2, :-1].mean() / mass)
        found = {"displacement": shown, "swept_displacement": swept}
        return {"stiffness": stiffness, "mean_natural_frequency": mean, **found}

    losses = [[_loss(config.shaft, depth, ratio) for ratio in ratios] for depth in depths.values()]
    given = {"crack": list(cracks), "direction": list(DIRECTIONS), "shaft_angle": angle, "harmonic": config.harmonics}
    given |= {"speed": config.shown_speeds_rad_s, "swept_speed": config.swept.speeds}
    given |= {"depth": list(depths), "turning": ["xi", "eta"], "depth_ratio": ratios}
    given |= {"natural_frequency": np.sqrt(k / mass), "depth_loss": np.moveaxis(np.array(losses), -1, 1)}
    return results("cracks", config.title, ("crack",), at, **given)


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
