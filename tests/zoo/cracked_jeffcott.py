"""A 2-DOF rotor with cracks of any kind."""

from machines import jeffcott_rig, point

from rotorstudy import build_model, registry

CRACKS = registry().plugins["crack"]
JEFFCOTT = point()
HARMONICS = [0, 1, 2, 3, 4, -1, -2, -3]
SHAFT = {"diameter_m": 0.02, "span_m": 0.45}


def rig(*cracks, unbalance_phase_rad=0.3, rotor=JEFFCOTT):
    return build_model(jeffcott_rig(2e-5, unbalance_phase_rad, cracks=list(cracks), rotor=rotor))


def crack(kind, loss=1.2e5, **options):
    given = {**CRACKS[kind].example, "weight_dominance": False, **options}
    return {"kind": kind, "stiffness_loss_N_per_m": loss, **given}
