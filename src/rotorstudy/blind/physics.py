"""Linear effects on the machine, derived from their physics and not from the tables of the plugin library.

Each is a function(plant, values, where) that adds forces, damping or stiffness to a Plant, named as the effect of the
plugin library; `gear_mesh` is foreign to it (see `simulated_effects`). Forces that turn with the shaft or are not
linear stand in `physics_in_time`.
values : by parameter name, SI, complex where they have a direction;  where : place and shape
Hysteretic damping and a pedestal (whose own motion is no coordinate of the plant) are applied to each harmonic.
"""

import numpy as np


def node_of(where, plant):
    """Node of an effect, by default the first of the rotor."""
    return where.get("node", plant.nominal.nodes[0])


def force_at(plant, where, motion="translation"):
    """Unit force (dof,) on the node of an effect."""
    found = np.zeros(plant.dof)
    found[plant.index(node_of(where, plant), motion)] = 1.0
    return found


def unbalance(plant, values, where):
    """Rotating force m e w^2 of an `eccentricity`, complex, m."""
    node = node_of(where, plant)
    i = plant.nominal.index(node)
    mass = where.get("mass_kg", plant.nominal.mass[i, i])  # the eccentricity is stated for the mass of the rig file
    plant.push(force_at(plant, where), 1, mass * values["eccentricity"] * plant.speed**2)


def couple_unbalance(plant, values, where):
    """Rotating moment of a `couple_unbalance`, complex, kg m^2."""
    plant.push(force_at(plant, where, "tilt"), 1, values["couple_unbalance"] * plant.speed**2)


def bow(plant, values, where):
    """Shaft bow, complex, m at its node or bent by an angle in some elements: the elastic force of the bowed line."""
    structure = plant.structure
    if "element" in where:
        plant.push(structure.stiffness @ _bent(plant, values, where), 1, 1.0)
        return
    here = force_at(plant, where)
    ends = [] if structure.is_supported else [structure.index(n) for n in (structure.nodes[0], structure.nodes[-1])]
    free = np.setdiff1d(np.arange(plant.dof), ends)
    shape = np.zeros(plant.dof)
    shape[free] = np.linalg.solve(structure.stiffness[np.ix_(free, free)], here[free])
    shape /= here @ shape
    plant.push(structure.stiffness @ shape, 1, values["bow"])


def _bent(plant, values, where):
    """Line (dof,) of a curvature that varies linearly over a stretch, by integrating it twice in small steps."""
    structure, steps = plant.structure, 2000
    elements = sorted({node for node, _ in structure.dofs})[:-1]
    lengths = [1 / np.abs(structure.curvature_at(element)).max() for element in elements]
    nodes = np.concatenate([[0], np.cumsum(lengths)])
    first, last = where["element"], where.get("last_element", where["element"])
    start, end = nodes[plant.place(first, element=True)[0] - 1], nodes[plant.place(last, element=True)[-1]]
    along = np.unique(np.concatenate([nodes, np.linspace(start, end, steps)]))
    middle = (along[1:] + along[:-1]) / 2
    share = np.where((middle > start) & (middle < end), 1 / (end - start), 0.0)
    skew = 2 * (middle - start) / (end - start) - 1
    curvature = -share * (values["bow_angle"] + skew * values["bow_angle_skew"])
    slope = np.concatenate([[0], np.cumsum(curvature * np.diff(along))])
    line = np.concatenate([[0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(along))])
    at = np.searchsorted(along, nodes)
    held = [i for i in range(len(nodes)) if (i + 1, "translation") not in structure.dofs]
    if len(held) == 2:  # the bearing line
        tilt = (line[at[held[1]]] - line[at[held[0]]]) / (nodes[held[1]] - nodes[held[0]])
        line, slope = line - line[at[held[0]]] - tilt * (along - nodes[held[0]]), slope - tilt
    return np.array([(line if motion == "translation" else slope)[at[node - 1]] for node, motion in structure.dofs])


def angular_misalignment(plant, values, where):
    """Moments at multiples of the spin speed, complex, N m."""
    for name, value in values.items():
        plant.push(force_at(plant, where, "tilt"), _order(name), value)


def parallel_misalignment(plant, values, where):
    """Forces at multiples of the spin speed, complex, N; opposite ones at the ends of a coupling that is an element."""
    if "element" in where:
        here = force_at(plant, {"node": where["element"]}) - force_at(plant, {"node": where["element"] + 1})
    else:
        here = force_at(plant, where)
    for name, value in values.items():
        plant.push(here, _order(name), value)


def _order(name):
    return int(name.split("_")[-1].removesuffix("X"))


def base_motion(plant, values, where):
    """Acceleration of the base at one harmonic of the spin speed, displacement complex, m."""
    n, (value,) = where["harmonic"], values.values()
    along = np.array([float(motion == "translation") for _, motion in plant.structure.dofs])
    plant.push(plant.structure.mass @ along, n, value * (n * plant.speed) ** 2)


def static_preload(plant, values, where):
    """Constant force, complex, N."""
    plant.push(force_at(plant, where), 0, values["static_preload"])


def gravity_direction(plant, values, where):
    """Weight rotated exactly, not to first order."""
    plant.push(plant.structure.static_load, 0, np.exp(1j * values["gravity_direction"]) - 1)


def external_damping(plant, values, where):
    """Dashpot to ground, N s/m."""
    c = values["external_damping"]
    plant.couple(plant.damping, plant.point(node_of(where, plant)), xx=c, yy=c)


def internal_damping(plant, values, where):
    """Damping of the shaft's motion in rotating axes, of the only disc, N s/m, or of the bending of one element, s."""
    pattern = stiffness_of(plant, where) if "element" in where else plant.point(node_of(where, plant))
    _rotating_damping(plant, pattern, values["internal_damping"])


def stiffness_of(plant, where):
    """(dof, dof) stiffness of an element or a stretch of the rig file; each element is several of this mesh."""
    stretch = range(where["element"], where.get("last_element", where["element"]) + 1)
    return sum(
        plant.structure.stiffness_loss_at(None, e)["stiffness_loss"][0]
        for element in stretch
        for e in plant.place(element, element=True)
    )


def shaft_damping(plant, values, where):
    """Internal damping proportional to the shaft's stiffness, s."""
    _rotating_damping(plant, plant.structure.stiffness, values["shaft_damping"])


def _rotating_damping(plant, matrix, c):
    """In axes that rotate with w the velocity is (x' + w y, y' - w x)."""
    plant.couple(plant.damping, matrix, xx=c, yy=c)
    plant.couple(plant.stiffness, matrix, xy=c * plant.speed, yx=-c * plant.speed)


def hysteretic_damping(plant, values, where):
    """Internal damping with a loss factor, independent of frequency."""
    shaft, zero = plant.structure.stiffness, np.zeros_like(plant.structure.stiffness)
    to_whirl = np.block([[np.eye(plant.dof), 1j * np.eye(plant.dof)], [np.eye(plant.dof), -1j * np.eye(plant.dof)]])

    def loss(n):
        """Forward part n bends at n - 1 times the speed, backward part -n at -n - 1 times."""
        forward, backward = np.sign(n - 1) * 1j * shaft, -np.sign(-n - 1) * 1j * shaft
        whirl = np.block([[forward, zero], [zero, backward]])
        return values["loss_factor"] * np.linalg.solve(to_whirl, whirl @ to_whirl)

    plant.stiffness_of_harmonic.append(loss)


def cross_coupling(plant, values, where):
    """Skew-symmetric stiffness at a node, N/m."""
    k = values["cross_coupling"]
    plant.couple(plant.stiffness, plant.point(node_of(where, plant)), xy=k, yx=-k)


def stiffness_error(plant, values, where):
    """Relative error of the shaft's stiffness."""
    share = values["stiffness_error"]
    plant.couple(plant.stiffness, plant.structure.stiffness, xx=share, yy=share)


def support_stiffness(plant, values, where):
    """Isotropic spring to ground, N/m."""
    k = values["support_stiffness"]
    plant.couple(plant.stiffness, plant.point(node_of(where, plant)), xx=k, yy=k)


def support_anisotropy(plant, values, where):
    """Difference of stiffness between two fixed directions at a node, complex, N/m."""
    k, angle = np.abs(values["support_anisotropy"]), np.angle(values["support_anisotropy"])
    here, c, s = plant.point(node_of(where, plant)), k * np.cos(angle), k * np.sin(angle)
    plant.couple(plant.stiffness, here, xx=c, yy=-c, xy=s, yx=s)


def support_loss(plant, values, where):
    """Spring to ground that is missing along one direction, N/m."""
    k, c, s = values["support_stiffness_loss"], np.cos(where["direction_rad"]), np.sin(where["direction_rad"])
    here = plant.point(node_of(where, plant))
    plant.couple(plant.stiffness, here, xx=-k * c * c, yy=-k * s * s, xy=-k * c * s, yx=-k * c * s)


def bearing_coefficients(plant, values, where):
    """Springs and dashpots to ground, with cross terms, N/m and N s/m."""
    for name, value in values.items():
        target = plant.stiffness if "stiffness" in name else plant.damping
        plant.couple(target, plant.point(node_of(where, plant)), **{name[-2:]: value})


def seal(plant, values, where):
    """Fluid that rotates at a share of the spin speed: its drag and its inertia act on the motion relative to it.

    In axes that rotate with it the inertia has a Coriolis and a centrifugal force.
    """
    k, k_0, c_x = (values[f"seal_{name}"] for name in ("stiffness", "cross_stiffness", "cross_damping"))
    here, c, m = plant.point(node_of(where, plant)), values["seal_damping"], values["seal_fluid_mass"]
    turning = where["swirl_ratio"] * plant.speed
    dragged, coriolis, pulled = c * turning + k_0, 2 * m * turning + c_x, k - m * turning**2
    plant.couple(plant.damping, here, xx=c, yy=c, xy=coriolis, yx=-coriolis)
    plant.couple(plant.stiffness, here, xx=pulled, yy=pulled, xy=dragged, yx=-dragged)
    plant.couple(plant.mass, here, xx=m, yy=m)


def pedestal_resonance(plant, values, where):
    """Bearing on a mass m on springs k_p, where a rigid support was modelled; m and k_p + k_b from the resonances.

    The bearing, with damping c_b, passes on its force of u - p, where m p'' + c p' + (k_p + k_b) p = c_b u' + k_b u is
    the motion p of the pedestal along x or y, c the sum of both dampings. The ratio of k_b to k_p + k_b is free, as the
    shaft sees only the loss at rest k_b^2 / (k_p + k_b); it is small, so that a cross stiffness q of the bearing gives
    way by q p_y, and moves the pedestal by q u_y, of which the bearing passes on its share.
    """
    ratio, lag, small = where["damping_ratio"], where["bearing_time_s"], 1e-6
    along_x = where["natural_frequency_rad_per_s"]
    frequency = {"x": along_x, "y": along_x * where["frequency_ratio"]}
    here = plant.point(node_of(where, plant))

    def followed(axis, n):
        """Motion of the pedestal per motion of the shaft, k_b / (k_p + k_b) at rest."""
        v, w0 = n * plant.speed, frequency[axis]
        return small * (1 + 1j * v * lag) * w0**2 / (w0**2 - v**2 + 2j * ratio * w0 * v)

    def passed_on(n):
        found = np.zeros((len(plant.speed), 2 * plant.dof, 2 * plant.dof), complex)
        for name, loss in values.items():
            row, column = name[-2:]
            if row == column:
                force = loss / small * (1 + 1j * n * plant.speed * lag)  # of the bearing, of a unit motion
                lost = force * followed(row, n)
            else:
                lost = loss / (2 * small) * (followed(row, n) + followed(column, n))
            plant.couple(found, here, **{row + column: -lost})
        return found

    plant.stiffness_of_harmonic.append(passed_on)


def added_mass(plant, values, where):
    """Mass at a node, with its weight."""
    m = values["added_mass"]
    plant.couple(plant.mass, plant.point(node_of(where, plant)), xx=m, yy=m)
    plant.push(force_at(plant, where), 0, m * plant.structure.acceleration_of_gravity)


def gyroscopic_error(plant, values, where):
    """Relative error of the gyroscopic moments."""
    share = values["gyroscopic_error"] * plant.speed
    plant.couple(plant.damping, plant.structure.gyroscopic, xy=share, yx=-share)


def bearing(plant, values, where):
    """Springs and dashpots, values by name: bearing_stiffness_xx, ..., or bearing_stiffness for both directions."""
    here = plant.point(where["node"])
    for name, value in values.items():
        target = plant.stiffness if name.startswith("bearing_stiffness") else plant.damping
        direction = name[-2:] if name[-3] == "_" else None
        plant.couple(target, here, **({direction: value} if direction else {"xx": value, "yy": value}))


def gear_mesh(plant, values, where):
    """A force of fixed direction at four times the spin speed: a pinion of four teeth."""
    force, direction = values["mesh_force_N"], where["direction_rad"]
    for n, phase in ((4, where["phase_rad"]), (-4, -where["phase_rad"])):
        plant.push(force_at(plant, where), n, force / 2 * np.exp(1j * (direction + phase)))
