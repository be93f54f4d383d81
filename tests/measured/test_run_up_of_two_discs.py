"""A run-up alone identifies unbalances, bearings and the shaft of a rotor with two discs, integrated in time here."""

import numpy as np
import xarray as xr
import yaml
from machines import disc, rig_of, shaft, springs, unbalance
from scipy.linalg import expm

from rotorstudy import Problem, build_model, measured_spectrum
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.model.rig_numbers import with_numbers

FIRST, LAST, RATE, STEP = 150.0, 380.0, 14.0, 1e-3
NODES, UNBALANCES = (2, 3), (2e-5, 1.5e-5 * np.exp(2j))  # kg m
STIFFNESS, DAMPING, MODULUS, STATED = 2e5, 200.0, 2.1e11, 2.06e11


def rig(modulus, damping, unbalances=(1e-5, 1e-5)):
    discs = [disc(node, 1.5, 3e-3, 1.6e-3) for node in NODES]
    rotor = shaft(0.25, 3, *discs, outer_diameter_m=0.01, youngs_modulus_Pa=modulus)
    sizes = zip(NODES, unbalances, strict=True)
    pushed = [unbalance(n, abs(u), float(np.angle(u)), label=str(n), mass_kg=1.0) for n, u in sizes]
    return rig_of(rotor, springs((1, 4), STIFFNESS, damping), *pushed, measurement={"harmonics": [0, 1, -1]})


def motion(structure):
    """Time s and displacement (node, time) m: exact in steps of constant speed, 1 / 1000 s long."""
    dof = len(structure.dofs)
    at = [structure.index(node) for node in (1, 2, 3, 4)]
    stiffness, damping = structure.stiffness.astype(complex), np.zeros((dof, dof), complex)
    for end in (at[0], at[3]):
        stiffness[end, end] += STIFFNESS
        damping[end, end] += DAMPING
    pull = sum(u * structure.unit(node) for node, u in zip(NODES, UNBALANCES, strict=True))
    inverse, state = np.linalg.inv(structure.mass), np.zeros(2 * dof + 1, complex)
    time, shown = np.arange(0, (LAST - FIRST) / RATE, STEP), []
    for i, t in enumerate(time):
        angle, speed = FIRST * t + RATE * t * t / 2, FIRST + RATE * (t + STEP / 2)
        table = np.zeros((2 * dof + 1, 2 * dof + 1), complex)
        table[:dof, dof:-1] = np.eye(dof)
        table[dof:-1, :dof] = -inverse @ stiffness
        table[dof:-1, dof:-1] = -inverse @ (damping - 1j * speed * structure.gyroscopic)
        table[dof:-1, -1] = inverse @ pull
        table[-1, -1] = 1j * speed
        state[-1] = ((FIRST + RATE * t) ** 2 - 1j * RATE) * np.exp(1j * angle)  # with the tangential force
        if i == 0:  # begins near the steady state
            dynamic = stiffness + 1j * FIRST * damping + FIRST**2 * (structure.gyroscopic - structure.mass)
            start = np.linalg.solve(dynamic, FIRST**2 * pull)
            state[:-1] = np.concatenate([start, 1j * FIRST * start])
        shown.append(state[[at[1], at[2]]])
        state = expm(table * STEP) @ state
    return time, np.array(shown).T


def test_a_run_up_alone_identifies_the_rotor(tmp_path):
    time, z = motion(build_model(rig(MODULUS, DAMPING)).structure)
    x, y = 2e-7 * np.random.default_rng(1).normal(size=(2, *z.shape))
    z = z + x + 1j * y
    turns = np.arange((FIRST * time[-1] + RATE * time[-1] ** 2 / 2) // (2 * np.pi) + 1)
    marks = (np.sqrt(FIRST**2 + 4 * np.pi * RATE * turns) - FIRST) / RATE
    shown = np.stack([z.real, z.imag], axis=1)[None]
    variables = {"displacement": (("speed", "node", "direction", "time"), shown, {"units": "m"}),
                 "phase_mark_time": (("speed", "revolution"), marks[None], {"units": "s"})}  # fmt: skip
    where = {"node": list(NODES), "direction": ["x", "y"], "time": time}
    xr.Dataset(variables, where).to_netcdf(tmp_path / "record.nc")
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig(STATED, 170.0)))
    spectrum, model, findings = measured_spectrum([tmp_path / "record.nc"], tmp_path / "rig.yaml")
    names = ("bearing_damping[1]", "bearing_damping[4]", "rotor.youngs_modulus_Pa",
             *(f"eccentricity[{node}]_{part}" for node in NODES for part in ("real", "imag")))  # fmt: skip
    found = output_error_fit(Problem(with_numbers(model, names, "the test"), spectrum, names))
    unbalances = [part for u in UNBALANCES for part in (complex(u).real, complex(u).imag)]
    true = np.array([DAMPING, DAMPING, MODULUS / STATED - 1, *unbalances])
    left = np.zeros(len(true))
    left[2] = 5e-4  # gyroscopic moments change in the sweep: g rate / decay^2 = 0.01 * 0.04 of the peak
    assert (np.abs(found.theta - true) < 4 * found.std + left).all(), (found.theta, true, found.std)
    assert {"run-up", "critical speeds"} <= {finding.name for finding in findings}
