"""A 2-DOF rotor with cracks of any kind."""

from rotorstudy import build_model, registry

CRACKS = registry().plugins["crack"]
JEFFCOTT = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
DAMPING = {"kind": "external_damping", "external_damping_N_s_per_m": 100.0}
HARMONICS = [0, 1, 2, 3, 4, -1, -2, -3]
SHAFT = {"diameter_m": 0.02, "span_m": 0.45}


def rig(*cracks, unbalance_phase_rad=0.3, rotor=JEFFCOTT):
    unbalance = {"kind": "unbalance", "eccentricity_m": 2e-5, "eccentricity_phase_rad": unbalance_phase_rad}
    return build_model({"rotor": rotor, "cracks": list(cracks), "effects": [DAMPING, unbalance]})


def crack(kind, loss=1.2e5, **options):
    given = {**CRACKS[kind].example, "weight_dominance": False, **options}
    return {"kind": kind, "stiffness_loss_N_per_m": loss, **given}
