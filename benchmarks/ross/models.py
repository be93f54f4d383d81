"""Small rotors with one bearing or seal of each class of ROSS, and with its other parts, saved by ROSS.

python benchmarks/ross/models.py OUT [NAME ...] writes OUT/NAME.toml, and into OUT/responses.json the unbalance response
by ROSS at speeds of its tables. The arguments are those of the examples in ROSS's documentation.
"""

import json
import sys
import warnings
from pathlib import Path

import numpy as np
import ross as rs
from ross.bearings.thrust_pad import thrust_pad_example
from ross.bearings.tilting_pad import tilting_pad_adiabatic_example
from ross.materials import steel
from ross.seals.holepattern_seal import HolePatternSeal
from ross.seals.hybrid_seal import HybridSeal
from ross.seals.labyrinth_seal import LabyrinthSeal
from ross.units import Q_

AIR = {"Nitrogen": 0.79, "Oxygen": 0.21}
RPM = Q_([3000, 4500, 6000], "RPM")
TEETH = {"radial_clearance": 0.0003, "n_teeth": 16, "pitch": 0.003175, "tooth_height": 0.003175}
TEETH |= {"tooth_width": 0.0001524, "seal_type": "inter", "preswirl": 0.98}
CELLS = {"radial_clearance": 0.0003, "length": 0.047, "roughness": 0.0001, "cell_length": 0.003175}
CELLS |= {"cell_width": 0.003175, "cell_depth": 0.0025, "preswirl": 0.8, "entr_coef": 0.5, "exit_coef": 1.0}
GAS = {"inlet_pressure": 308000, "outlet_pressure": 94300, "inlet_temperature": 300.0, "gas_composition": AIR}


def squeeze_film():
    size = {"axial_length": 0.02286, "journal_radius": 0.06477, "radial_clearance": 7.62e-5}
    return rs.SqueezeFilmDamper(n=0, frequency=RPM, **size, eccentricity_ratio=0.5, lubricant="ISOVG32")


def plain_journal():
    size = {"axial_length": 0.263144, "journal_radius": 0.2, "radial_clearance": 1.95e-4}
    mesh = {"elements_circumferential": 11, "elements_axial": 3, "n_pad": 2, "pad_arc_length": 176}
    state = {"preload": 0, "geometry": "circular", "reference_temperature": 50, "fxs_load": 0, "fys_load": -112814.91}
    oil = {"lubricant": "ISOVG32", "groove_factor": [0.52, 0.48], "oil_supply_pressure": 0}
    speeds = Q_([900, 1200], "RPM")
    return rs.PlainJournal(n=0, frequency=speeds, **size, **mesh, **state, **oil, oil_flow_v=Q_(37.86, "l/min"))


def pads(example):
    bearing = example()
    bearing.n = bearing.n_l = bearing.n_r = 0
    return bearing


def fluid_flow():
    size = {"nz": 8, "ntheta": 64, "length": 0.04, "radius_rotor": 0.2, "radius_stator": 0.2002}
    return rs.BearingFluidFlow(
        n=0, omega=np.array([100.0, 200.0]), p_in=0.0, p_out=0.0, load=525, visc=0.1, rho=860.0, **size
    )


def hybrid():
    teeth = {**TEETH, "n_teeth": 10, "tz": [300.0, 299.5], "muz": [1.85e-05, 1.84e-05]}
    return HybridSeal(
        n=1, shaft_radius=0.025, frequency=RPM, hole_pattern_parameters=CELLS, labyrinth_parameters=teeth, **GAS
    )


BEARINGS = {
    "BearingElement": lambda: rs.BearingElement(
        n=0, kxx=1e7, kyy=2e7, kxy=1e6, kyx=-2e6, cxx=1e3, cyy=2e3, mxx=3.0, myy=4.0
    ),
    "BearingElement_over_speed": lambda: rs.BearingElement(
        n=0, kxx=[1e7, 2e7, 3e7], kxy=[1e5, 2e5, 4e5], cxx=[1e3, 2e3, 2e3], frequency=[0.0, 300.0, 600.0]
    ),
    "BallBearingElement": lambda: rs.BallBearingElement(
        n=0, n_balls=8, d_balls=0.03, fs=500.0, alpha=np.pi / 6, tag="ballbearing"
    ),
    "RollerBearingElement": lambda: rs.RollerBearingElement(
        n=0, n_rollers=8, l_rollers=0.03, fs=500.0, alpha=np.pi / 6
    ),
    "MagneticBearingElement": lambda: rs.MagneticBearingElement(
        n=0, g0=1e-3, i0=1.0, ag=1e-4, nw=200, alpha=0.392, kp_pid=1, kd_pid=1, frequency=np.linspace(100, 600, 5)
    ),
    "CylindricalBearing": lambda: rs.CylindricalBearing(
        n=0, speed=np.array([5.0, 100.0, 200.0, 419.0, 600.0]), weight=525, bearing_length=0.03, journal_diameter=0.1,
        radial_clearance=1e-4, oil_viscosity=0.1,
    ),
    "BearingFluidFlow": fluid_flow,
    "PlainJournal": plain_journal,
    "SqueezeFilmDamper": squeeze_film,
    "TiltingPad": lambda: pads(tilting_pad_adiabatic_example),
    "ThrustPad": lambda: pads(thrust_pad_example),
    "SealElement": lambda: rs.SealElement(
        n=1, kxx=1e5, kxy=3e4, kyx=-3e4, cxx=200.0, cxy=20.0, cyx=-20.0, mxx=1.0, myy=1.0
    ),
    "SealElement_over_speed": lambda: rs.SealElement(
        n=1, kxx=[1e5, 2e5], kxy=[0.0, 5e4], kyx=[0.0, -5e4], cxx=[200.0, 250.0], frequency=[0.0, 600.0]
    ),
    "LabyrinthSeal": lambda: LabyrinthSeal(n=1, shaft_radius=0.0725, frequency=RPM, **TEETH, **GAS),
    "HolePatternSeal": lambda: HolePatternSeal(n=1, shaft_radius=0.0725, frequency=RPM, nz=18, **CELLS, **GAS),
    "HybridSeal": hybrid,
}  # fmt: skip


SOFT = rs.Material("sleeve", rho=7833.0, E=6894.75, G_s=6894.75)
ALUMINIUM = rs.Material("aluminium", rho=2700.0, E=7e10, G_s=2.63e10)


def shaft(count=4, **options):
    return [rs.ShaftElement(L=0.125, idl=0.0, odl=0.05, material=steel, n=n, **options) for n in range(count)]


def sleeve(material):
    return [rs.ShaftElement(L=0.125, idl=0.05, odl=0.09, material=material, n=n) for n in (1, 2)]


def ends(**options):
    return [rs.BearingElement(n=n, kxx=1e7, kyy=2e7, cxx=1e3, **options) for n in (0, 4)]


def on_supports():
    """Both bearings on supports, one with another mass in x and y."""
    bases = [rs.BearingElement(n=n, kxx=3e7, kyy=2e7, cxx=2e3, cyy=3e3) for n in (5, 6)]
    hung = [rs.BearingElement(n=n, n_link=link, kxx=1e7, kyy=2e7, cxx=1e3) for n, link in ((0, 5), (4, 6))]
    masses = [rs.PointMass(n=5, mx=8.0, my=12.0, mz=10.0), rs.PointMass(n=6, m=5.0)]
    return rs.Rotor(shaft(), [wheel(2)], hung + bases, masses)


def wheel(n):
    return rs.DiskElement(n=n, m=30.0, Id=0.1, Ip=0.2)


PARTS = {
    "layers": lambda: rs.Rotor(shaft() + sleeve(ALUMINIUM), [wheel(2)], ends()),
    "sleeves": lambda: rs.Rotor(shaft() + sleeve(SOFT), [wheel(2)], ends()),
    "supports": on_supports,
    "stiffness_damping": lambda: rs.Rotor(shaft(beta=1e-5), [wheel(2)], ends()),
    "axial_force": lambda: rs.Rotor(shaft(axial_force=2e5), [wheel(2)], ends()),
}


def with_part(part):
    """A rotor on the bearing, or on two bearings with the seal."""
    near = [] if part.n == 0 and np.any(part.kxx) else [rs.BearingElement(n=0, kxx=1e7, cxx=1e3)]
    return rs.Rotor(shaft(2), [wheel(1)], [part, *near, rs.BearingElement(n=2, kxx=1e7, cxx=1e3)])


def response(rotor, speeds):
    """Real and imaginary parts of x and y (axis, part, node, speed), m, to 1 g m at the disc, at 0.4 rad."""
    found = rotor.run_unbalance_response([rotor.disk_elements[0].n], [1e-3], [0.4], np.array(speeds))
    nodes = len(rotor.nodes)
    both = [found.forced_resp[[rotor.number_dof * n + k for n in range(nodes)]] for k in (0, 1)]
    return [[part.real.tolist(), part.imag.tolist()] for part in both]


def main(out, *names):
    warnings.simplefilter("ignore")
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    file = out / "responses.json"
    for name in names or (*BEARINGS, *PARTS):
        speeds, part = [100.0, 300.0, 500.0], None if name in PARTS else BEARINGS[name]()
        if part is not None:
            speeds = [float(w) for w in np.ravel(part.frequency) if w > 0] if len(part.kxx) > 1 else [300.0]
        rotor = PARTS[name]() if part is None else with_part(part)
        (out / f"{name}.toml").unlink(missing_ok=True)
        rotor.save(out / f"{name}.toml")
        if name == "TiltingPad":  # a new one has an array in place of its method C
            rotor = rs.Rotor.load(out / f"{name}.toml")
        known = json.loads(file.read_text()) if file.is_file() else {}
        known[name] = {"speeds_rad_s": speeds, "xy": response(rotor, speeds)}
        file.write_text(json.dumps(known) + "\n")
        print(name, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
