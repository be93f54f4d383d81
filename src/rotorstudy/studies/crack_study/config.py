"""Configuration of the study of transverse cracks."""

from typing import Any

from pydantic import Field

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.options import Positive
from rotorstudy.model.rig import build_model
from rotorstudy.yaml_file import read_study


class CrackedRotor(Strict):
    """rotor, bearings, effects : as in a rig, without a crack;  speeds_rad_s : measured"""

    source: str  # of the geometry
    rotor: dict[str, Any]
    bearings: list[dict[str, Any]]
    effects: list[dict[str, Any]]
    speeds_rad_s: list[Positive] = Field(min_length=1)
    planes: dict[str, list[int]] = Field(min_length=1)  # name -> nodes with probes
    confounders: dict[str, dict[str, Any]] = {}  # name -> effect that may be present in the healthy machine, too

    @property
    def nodes(self):
        """All nodes with probes."""
        return sorted({node for nodes in self.planes.values() for node in nodes})

    def model(self, *effects, **other):
        """Model with all probes and further effects; other : sections of the rig."""
        given = {"rotor": self.rotor, "bearings": self.bearings, "effects": [*self.effects, *effects]}
        return build_model({**given, "sensors": self.nodes, **other}, where=self.source)


class CrackMap(Strict):
    """positions : how many, along the shaft;  depth_ratios, angles_rad : at each"""

    positions: int = Field(ge=2)
    depth_ratios: list[Positive] = Field(min_length=2)
    angles_rad: list[float] = Field(min_length=1)


class Crack(Strict):
    """A crack in detail."""

    position_m: Positive
    depth_ratio: Positive
    angle_rad: float


class CrackModel(Strict):
    """kind : the effect;  variant : its other options than position, depth and angle;  amplitudes : of the real one"""

    kind: str
    variant: dict[str, Any] = {}
    amplitudes: dict[str, float]

    def effect(self, position_m, depth_ratio, angle_rad):
        """A crack as an effect of a rig."""
        shape = {"position_m": position_m, "depth_ratio": depth_ratio, "angle_rad": angle_rad}
        return {"kind": self.kind, **self.variant, **shape, **self.amplitudes}


class Trials(Strict):
    """count : noisy records at each of `depth_ratios`, of the reference crack otherwise"""

    count: int = Field(ge=2)
    depth_ratios: list[Positive] = Field(min_length=1)
    seed: int


class Fronts(Strict):
    """Records of cracks with other fronts than the library's, drawn within pairs of limits."""

    count: int = Field(ge=1)
    depth_ratios: list[Positive] = Field(min_length=2, max_length=2)
    curvatures: list[float] = Field(min_length=2, max_length=2)
    closing_shares: list[float] = Field(min_length=2, max_length=2)  # of a residual moment, over the static one
    poissons_ratios: list[Positive] = Field(min_length=2, max_length=2)
    positions: list[Positive] = Field(min_length=1)  # over the length, one of which each crack has
    laws: dict[str, dict[str, Any]] = Field(min_length=1)  # name -> options by which a straight front has a depth
    straight: str  # depth plugin of the last law, that of the library
    seed: int


class ThesisMethod(Strict):
    """cracks : of the thesis's model;  estimator, unknowns : of its estimate;  depth_ratio : of the true crack"""

    estimator: str
    cracks: list[dict[str, Any]]
    unknowns: list[str]
    depth_ratio: Positive


class Passage(Strict):
    """lowest_rad_s, highest_rad_s, count : speeds of the run-up"""

    lowest_rad_s: Positive
    highest_rad_s: Positive
    count: int = Field(ge=2)
    node: int
    orders: list[int] = Field(min_length=1)  # harmonics at `node`
    depth_ratios: list[Positive] = Field(min_length=1)  # of the reference crack


class CrackStudy(Strict):
    """crack : how it is modelled;  rotors : name -> CrackedRotor, of which the first is studied in detail"""

    name: str
    title: str
    crack: CrackModel
    rotors: dict[str, CrackedRotor] = Field(min_length=1)
    harmonics: list[int] = Field(min_length=1)
    samples: int = Field(gt=1)  # of a record, all together
    noise_percent: list[Positive] = Field(min_length=1)  # white noise on each sample, of the rms vibration
    usual_noise_percent: Positive  # where not varied
    probe_noise_m: float = Field(ge=0)  # white noise on each sample, whatever the vibration
    diagnosis: Settings  # as in a rig: accuracy of its numbers, of the probes and of the model
    false_alarm: float = Field(gt=0, lt=0.5)  # of the test by which a crack is detected
    power: float = Field(gt=0.5, lt=1)  # likewise
    map: CrackMap
    accuracy: CrackMap
    reference: Crack
    trials: Trials
    fronts: Fronts
    passage: Passage
    thesis: ThesisMethod

    @property
    def main(self):
        """The rotor that is studied in detail."""
        return next(iter(self.rotors.values()))


def load_crack_study(path):
    """The CrackStudy of a file, whose rigs can be built and whose reference crack lies on the shaft."""
    study = check_config(CrackStudy, read_study(path), str(path))
    check_known("usual_noise_percent", [study.usual_noise_percent], study.noise_percent, str(path))
    for rotor in study.rotors.values():
        rotor.model()
    study.main.model(study.crack.effect(**study.reference.model_dump()))
    check_known("node", [study.passage.node], study.main.nodes, f"{path}, passage")
    if not study.passage.lowest_rad_s < study.passage.highest_rad_s or not {2} <= set(study.passage.orders):
        raise RotorstudyError(f"{path}, passage: lowest_rad_s must be below highest_rad_s, and orders must include 2")
    return study
