from typing import Literal, NotRequired

import numpy as np

from rotorstudy.plugins import (
    AtLeastOne,
    CannotAct,
    NonNegative,
    PoissonsRatio,
    Positive,
    RigidDisc,
    Rotor,
    RotorstudyError,
    Section,
    Structure,
    TypedDict,
    Whole,
    check_known,
    unknown_name,
)

MOST_ELEMENTS = 500  # the state matrix at one speed then takes 0.3 GB
GAUSS = np.polynomial.legendre.leggauss(4)  # exact up to degree 7; the mass integrand has degree 6


class Diameters(TypedDict, total=False):
    """Those at the end of a cone; omitted ones are those of its start."""

    outer_diameter_m: Positive
    inner_diameter_m: NonNegative


class Layer(TypedDict):
    """A sleeve that bends with the shaft; one without stiffness has `youngs_modulus_Pa: 0`."""

    outer_diameter_m: Positive
    inner_diameter_m: NonNegative
    youngs_modulus_Pa: NotRequired[NonNegative]
    shear_modulus_Pa: NotRequired[Positive]
    poissons_ratio: NotRequired[PoissonsRatio]
    density_kg_per_m3: NotRequired[NonNegative]


class Stretch(TypedDict):
    """A section of shaft in `count` equal elements, cylinders; omitted values are those of the rotor."""

    length_m: Positive
    count: NotRequired[Whole]
    outer_diameter_m: NotRequired[Positive]
    inner_diameter_m: NotRequired[NonNegative]
    end: NotRequired[Diameters]
    youngs_modulus_Pa: NotRequired[Positive]
    shear_modulus_Pa: NotRequired[Positive]
    poissons_ratio: NotRequired[PoissonsRatio]
    density_kg_per_m3: NotRequired[Positive]
    axial_force_N: NotRequired[float]
    layers: NotRequired[list[Layer]]


class Disc(TypedDict):
    """Mass and moments, or the dimensions of a cylinder; its density is that of the rotor by default."""

    node: int
    mass_kg: NotRequired[Positive]
    polar_moment_kg_m2: NotRequired[NonNegative]
    diametral_moment_kg_m2: NotRequired[NonNegative]
    thickness_m: NotRequired[Positive]
    diameter_m: NotRequired[Positive]
    bore_m: NotRequired[NonNegative]
    density_kg_per_m3: NotRequired[Positive]
    label: NotRequired[str]


class PointMass(TypedDict):
    node: int
    mass_kg: Positive


class StaticForce(TypedDict):
    """Beside the weight and along it, or along x of an upright rotor: the thrust of a volute, a belt."""

    node: int
    force_N: float


@Rotor(
    source="Nelson and McVaugh 1976; Nelson 1980; thesis Chapter 6; sign of the gyroscopic moment corrected",
    checked="closed-form beams by order of convergence; thesis Tables 6.2 to 6.7 within 0.05 %",
    uncertain={"youngs_modulus_Pa": 0.005, "density_kg_per_m3": 0.005, "discs": 0.005},
    example={
        "elements": [{"length_m": 0.6, "count": 3}],
        "outer_diameter_m": 0.02,
        "discs": [{"node": 2, "mass_kg": 2.0, "polar_moment_kg_m2": 0.0048, "diametral_moment_kg_m2": 0.0024}],
    },
)
def finite_element(
    elements: AtLeastOne[Stretch],
    outer_diameter_m: Positive | None = None,
    inner_diameter_m: NonNegative = 0.0,
    youngs_modulus_Pa: Positive = 2.1e11,
    poissons_ratio: PoissonsRatio | None = None,
    shear_modulus_Pa: Positive | None = None,
    density_kg_per_m3: Positive = 7850.0,
    axial_force_N: float = 0.0,
    discs: list[Disc] = (),
    point_masses: list[PointMass] = (),
    static_forces: list[StaticForce] = (),
    pinned_nodes: list[int] = (),
    clamped_nodes: list[int] = (),
    theory: Literal["timoshenko", "euler_bernoulli"] = "timoshenko",
    shaft_inertia: Literal["gyroscopic", "rotary", "translation"] = "gyroscopic",
    gyroscopic_sign: Literal[1, -1] = 1,
    gravity_m_per_s2: NonNegative = 9.81,
):
    """Shaft of beam elements with rigid discs: at each node z = u_x + j u_y and the tilt of the section.

    Nodes and elements are numbered from 1 at the end s = 0. The shaft is carried by bearings or by rigid supports:
    pinned_nodes fix the translation, clamped_nodes the tilt too. A stretch with diameters at its `end` is a cone of
    `count` cylinders, whose error falls with the square of their number. `layers` share the sections of the shaft,
    which stay plane. axial_force_N is tension. Poisson's ratio is 0.3, or follows from shear_modulus_Pa. shaft_inertia
    "rotary" omits the gyroscopic moments of the shaft, "translation" also its rotary inertia. gyroscopic_sign -1 is
    the reversed sign of the thesis.
    """
    common = {
        "outer_diameter_m": outer_diameter_m,
        "inner_diameter_m": inner_diameter_m,
        "youngs_modulus_Pa": youngs_modulus_Pa,
        "poissons_ratio": poissons_ratio,
        "shear_modulus_Pa": shear_modulus_Pa,
        "density_kg_per_m3": density_kg_per_m3,
        "axial_force_N": axial_force_N,
    }
    if sum(stretch.get("count", 1) for stretch in elements) > MOST_ELEMENTS:
        raise RotorstudyError(f"finite_element: more than {MOST_ELEMENTS} elements; give stretches a smaller count")
    cut = [element for stretch in elements for element in _cut({**common, **stretch}, theory == "timoshenko")]
    discs = [_disc(disc, density_kg_per_m3) for disc in discs]
    discs_at, masses_at = [disc.node for disc in discs], [mass["node"] for mass in point_masses]
    forces_at, every = [force["node"] for force in static_forces], range(1, len(cut) + 2)
    stated = {"discs": discs_at, "point_masses": masses_at, "static_forces": forces_at, "pinned_nodes": pinned_nodes}
    for name, nodes in {**stated, "clamped_nodes": clamped_nodes}.items():
        check_known("node", nodes, every, f"{name} of the finite_element rotor")
    fixed = {(n, "translation") for n in [*pinned_nodes, *clamped_nodes]} | {(n, "tilt") for n in clamped_nodes}
    shaft = _Shaft(cut, fixed, discs_at, gravity_m_per_s2)
    mass, stiffness, gyroscopic, weight = _assembled(
        shaft, shaft_inertia, [*discs, *(RigidDisc(body["node"], body["mass_kg"], 0.0, 0.0) for body in point_masses)]
    )
    load = gravity_m_per_s2 * weight
    for force in static_forces:
        load[2 * force["node"] - 2] += force["force_N"]
    square = np.ix_(shaft.free, shaft.free)
    return Structure(
        mass=mass[square],
        stiffness=stiffness[square],
        gyroscopic=gyroscopic_sign * gyroscopic[square],
        static_load=load[shaft.free],
        dofs=shaft.dofs,
        stiffness_loss=shaft.stiffness_loss,
        shape_at=shaft.shape_at,
        curvature_at=shaft.curvature_at,
        section_at=shaft.section_at,
        length=shaft.length,
        node_positions=dict(zip(shaft.nodes, [0.0, *shaft.ends], strict=True)),
        discs=tuple(discs),
        is_solid=all(element["inner_diameter_m"] == 0 for element in cut),
        gravity=gravity_m_per_s2,
    )


def _disc(given, density):
    """The RigidDisc of an item of `discs`."""
    stated = [given.get(key) for key in ("mass_kg", "polar_moment_kg_m2", "diametral_moment_kg_m2")]
    thickness, outer, inner = given.get("thickness_m"), given.get("diameter_m"), given.get("bore_m", 0.0)
    where = f"finite_element: disc at node {given['node']}"
    if None not in stated and thickness is outer is None and not {"bore_m", "density_kg_per_m3"} & {*given}:
        return RigidDisc(given["node"], *stated)
    if any(value is not None for value in stated) or thickness is None or outer is None:
        raise RotorstudyError(
            f"{where}: give mass_kg, polar_moment_kg_m2 and diametral_moment_kg_m2, or thickness_m and diameter_m "
            "(with bore_m and density_kg_per_m3 if need be), not a mixture"
        )
    if inner >= outer:
        raise RotorstudyError(f"{where}: bore_m = {inner:g} must be smaller than diameter_m = {outer:g}")
    mass = given.get("density_kg_per_m3", density) * np.pi / 4 * (outer**2 - inner**2) * thickness
    polar = mass / 8 * (outer**2 + inner**2)
    return RigidDisc(given["node"], mass, polar, polar / 2 + mass * thickness**2 / 12)


class _Shaft:
    """Beam elements in a row and the coordinates that no rigid support holds."""

    def __init__(self, elements, fixed, discs_at, gravity):
        self.elements, self.discs_at, self.gravity = elements, discs_at, gravity
        self.nodes = range(1, len(elements) + 2)
        every = [(node, motion) for node in self.nodes for motion in ("translation", "tilt")]
        self.free = [i for i, place in enumerate(every) if place not in fixed]
        self.dofs = tuple(every[i] for i in self.free)
        if not any(motion == "translation" for _, motion in self.dofs):
            raise RotorstudyError("finite_element: pinned_nodes and clamped_nodes fix every node; leave one free")
        of_stretch = {id(element): _matrices(element) for element in {id(one): one for one in elements}.values()}
        self.matrices = [of_stretch[id(element)] for element in elements]  # equal ones of a stretch are one object
        self.ends = np.cumsum([element["length_m"] for element in elements])
        self.length = sum(element["length_m"] for element in elements)

    def stiffness_loss(self, node, element):
        """A share of the stiffness of an element, or at a node that of its translation and of its tilt (thesis)."""
        if element is not None:
            numbers = range(1, len(self.elements) + 1)
            if element not in numbers:
                raise unknown_name("element", element, numbers, "the finite_element rotor", CannotAct)
            pattern, ends = np.zeros((len(self.free), len(self.free))), 2 * element - 2 + np.arange(4)
            free = np.isin(ends, self.free)
            here = np.searchsorted(self.free, ends[free])
            pattern[np.ix_(here, here)] = self.matrices[element - 1][2][np.ix_(free, free)]
            return {"stiffness_loss": (pattern, "1", 0.1)}
        rigidity = self.length / sum(element["length_m"] / element["rigidity"] for element in self.elements)
        losses = {}
        for name, motion, unit, typical in (
            ("stiffness_loss_22", "translation", "N/m", 5 * rigidity / self.length**3),
            ("stiffness_loss_44", "tilt", "N m", rigidity / self.length),
        ):
            if (node, motion) in self.dofs:
                losses[name] = (np.diag([float(place == (node, motion)) for place in self.dofs]), unit, typical)
        return losses

    def shape_at(self, position):
        """Shape functions (dof,) at a position (m) from node 1."""
        i, x = self._located(position)
        return self._of_element(i, _deflection(np.array([x]), self.elements[i])[:, 0])

    def section_at(self, position):
        """The Section at a position (m) from node 1; of a uniform beam between its nodes, statically exact."""
        i, x = self._located(position)
        near = 1e-9 * self.length
        at_node = [node for node, s in zip(self.nodes, [0.0, *self.ends], strict=True) if abs(position - s) < near]
        if any(node in at_node for node in self.discs_at):
            raise CannotAct(f"position_m = {position:g}: a disc is there, at node {at_node[0]}; choose one beside it")
        element = self.elements[i]
        span, phi = element["length_m"], element["shear"]
        rigidity, weight = element["rigidity"], self.gravity * element["line_mass"]
        return Section(
            position=position,
            **{key: element[key] for key in Section._fields if key in element},
            sleeve_diameter_m=max((layer["outer_diameter_m"] for layer in element["layers"]), default=0.0),
            moment=self._of_element(i, rigidity * np.array(_curvature(x, element)) / (1 + phi)),
            own_moment=weight * span**2 / 12 * (1 - 6 * x + 6 * x**2),
            stiffness=rigidity / span * (4 + phi - 12 * x * (1 - x)) / (1 + phi),
        )

    def curvature_at(self, element):
        """Mean curvature (dof,) of an element: the difference of the tilts of its ends over its length."""
        return self._of_element(element - 1, np.array([0, -1, 0, 1]) / self.elements[element - 1]["length_m"])

    def _located(self, position):
        """Index of the element at a position (m) from node 1, and the relative position in it."""
        length = self.length
        if not 0 <= position <= length * (1 + 1e-12):
            raise RotorstudyError(f"finite_element: position {position:g} m is not on the shaft of 0 to {length:g} m")
        i = min(int(np.searchsorted(self.ends, position)), len(self.elements) - 1)
        return i, 1 + (position - self.ends[i]) / self.elements[i]["length_m"]

    def _of_element(self, i, values):
        """Row (dof,) with values (4,) at the coordinates of an element."""
        row = np.zeros(2 * len(self.nodes))
        row[_coordinates(i)] = values
        return row[self.free]


def _coordinates(i):
    """Translation and tilt of both ends of the element of index i, among those of all nodes."""
    return slice(2 * i, 2 * i + 4)


def _assembled(shaft, shaft_inertia, bodies):
    """Mass, stiffness and gyroscopic matrix and weight over gravity, before rigid supports."""
    size = 2 * len(shaft.nodes)
    mass, stiffness, gyroscopic = np.zeros((3, size, size))
    weight = np.zeros(size)
    for i, (translation, rotary, bend, tension) in enumerate(shaft.matrices):
        here = _coordinates(i)
        mass[here, here] += translation + (rotary if shaft_inertia != "translation" else 0)
        gyroscopic[here, here] += 2 * rotary if shaft_inertia == "gyroscopic" else 0
        stiffness[here, here] += bend + tension
        weight[here] += translation @ [1, 0, 1, 0]
    for body in bodies:
        here, tilt = 2 * body.node - 2, 2 * body.node - 1
        mass[here, here] += body.mass
        mass[tilt, tilt] += body.diametral_moment
        gyroscopic[tilt, tilt] += body.polar_moment
        weight[here] += body.mass
    return mass, stiffness, gyroscopic, weight


def _cut(stretch, shear):
    """The elements of a stretch, with sums over their layers and `shear`; impossible diameters or moduli are errors."""
    count, first = stretch.get("count", 1), {key: stretch[key] for key in Diameters.__annotations__}
    last = first | stretch.get("end", {})
    if first["outer_diameter_m"] is None:
        raise RotorstudyError("finite_element: give outer_diameter_m of the rotor, or of each of the elements")
    layers = [{**stretch, "poissons_ratio": None, **layer} for layer in stretch.get("layers", ())]
    parts = [{**stretch, **first}, {**stretch, **last}, *layers]
    for part in parts:
        if part["inner_diameter_m"] >= part["outer_diameter_m"]:
            raise RotorstudyError(
                f"finite_element: inner_diameter_m = {part['inner_diameter_m']:g} must be smaller than "
                f"outer_diameter_m = {part['outer_diameter_m']:g}"
            )
    common = {**stretch, "length_m": stretch["length_m"] / count, "poissons_ratio": _poissons_ratio(stretch)}
    common["layers"] = [{**layer, "poissons_ratio": _poissons_ratio(layer)} for layer in layers]
    found = []
    for place in (np.arange(count) + 0.5) / count if last != first else [0.0]:
        element = common | {key: float(value + place * (last[key] - value)) for key, value in first.items()}
        *own, slid = (_section(element) + sum(map(_section, element["layers"]))).tolist()
        element |= dict(zip(("rigidity", "line_mass", "line_inertia"), own, strict=True))
        bent, slid = 12 * element["rigidity"], slid * element["length_m"] ** 2
        found.append({**element, "shear": bent / slid if shear else 0.0})  # 12 E I / (kappa G A l^2)
    return found if last != first else found * count


def _poissons_ratio(material):
    """As stated, or by the shear modulus; 0.3 by default."""
    ratio, modulus, shear = (material.get(key) for key in ("poissons_ratio", "youngs_modulus_Pa", "shear_modulus_Pa"))
    if shear is None or modulus == 0:
        return 0.3 if ratio is None else ratio
    found = modulus / (2 * shear) - 1
    if ratio is not None or not 0 <= found <= 0.5:
        raise RotorstudyError(
            f"finite_element: shear_modulus_Pa = {shear:g} "
            + (
                f"beside poissons_ratio = {ratio:g}: give one of them"
                if ratio is not None
                else f"with youngs_modulus_Pa = {modulus:g} is a Poisson's ratio of {found:.3g}; it lies from 0 to 0.5"
            )
        )
    return found


def _section(section):
    """E I, rho A, rho I and kappa G A, with the shear coefficient kappa of Cowper (1966), solid or hollow."""
    outer, inner, ratio = (section[key] for key in ("outer_diameter_m", "inner_diameter_m", "poissons_ratio"))
    modulus, density = section["youngs_modulus_Pa"], section["density_kg_per_m3"]
    area, fourth_powers = np.pi / 4 * (outer**2 - inner**2), outer**4 - inner**4
    hollow = (1 + (inner / outer) ** 2) ** 2
    kappa = 6 * (1 + ratio) * hollow / ((7 + 6 * ratio) * hollow + (20 + 12 * ratio) * (inner / outer) ** 2)
    bent, inertia = (size * np.pi / 64 * fourth_powers for size in (modulus, density))
    return np.array([bent, density * area, inertia, kappa * (modulus / (2 * (1 + ratio))) * area])


def _deflection(x, element):
    """Translation (4, point) at relative positions x of an element, due to z, tilt, z, tilt of its ends."""
    length, phi = element["length_m"], element["shear"]
    shapes = [
        1 - 3 * x**2 + 2 * x**3 + phi * (1 - x),
        length * (x - 2 * x**2 + x**3 + phi / 2 * (x - x**2)),
        3 * x**2 - 2 * x**3 + phi * x,
        length * (x**3 - x**2 - phi / 2 * (x - x**2)),
    ]
    return np.array(shapes) / (1 + phi)


def _curvature(x, element):
    """Change of the tilt per length (4) at relative positions x, due to z, tilt, z, tilt of the ends, times 1 + phi."""
    length, phi = element["length_m"], element["shear"]
    ends = [(6 * x - 4 - phi) / length, (6 * x - 2 + phi) / length]
    return [6 * (2 * x - 1) / length**2, ends[0], 6 * (1 - 2 * x) / length**2, ends[1]]


def _matrices(element):
    """Translational mass, rotary inertia, stiffness and that of tension, each (4, 4) on z, tilt, z, tilt.

    The shape functions are the static solutions of the unloaded beam (Przemieniecki 1968; Nelson 1980). Without shear
    it is the Euler-Bernoulli beam.
    """
    length, phi = element["length_m"], element["shear"]
    rigidity = element["rigidity"]
    x, root = (1 + GAUSS[0]) / 2, np.sqrt(GAUSS[1] / 2 * length)
    deflection = _deflection(x, element) * (1 + phi)
    turned = 6 * (x**2 - x) / length
    tilt = [turned, 1 - 4 * x + 3 * x**2 + phi * (1 - x), -turned, 3 * x**2 - 2 * x + phi * x]
    curvature = _curvature(x, element)
    sliding = np.sqrt(12 * rigidity * phi / length) / (1 + phi) * np.array([1 / length, 1 / 2, -1 / length, 1 / 2])
    slope = np.array(tilt) + np.outer([-phi / length, -phi / 2, phi / length, -phi / 2], np.ones(len(x)))
    rows = (np.array(part) * root / (1 + phi) for part in (deflection, tilt, curvature, slope))
    deflection, tilt, curvature, slope = rows
    return (
        element["line_mass"] * (deflection @ deflection.T),
        element["line_inertia"] * (tilt @ tilt.T),
        rigidity * (curvature @ curvature.T) + np.outer(sliding, sliding),
        element["axial_force_N"] * (slope @ slope.T),
    )
