import numpy as np

from rotorstudy.plugins import Positive, Rotor, Structure


@Rotor(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
    uncertain={"stiffness_N_per_m": 0.005},  # relative standard deviations where a rig states none
    example={"disc_mass_kg": 2.0, "stiffness_N_per_m": 7e5},
)
def my_model(disc_mass_kg: Positive, stiffness_N_per_m: Positive):
    """Two equal discs on a massless shaft, coupled by its stiffness: [[2, -1], [-1, 2]] k."""
    # The arguments are options in the rig file, with their unit in the name. Coordinates are complex, z = x + j y with
    # x down; list them in `dofs`. The rig file adds effects, bearings and cracks.
    return Structure(
        mass=disc_mass_kg * np.eye(2),
        stiffness=stiffness_N_per_m * np.array([[2.0, -1.0], [-1.0, 2.0]]),
        gyroscopic=np.zeros((2, 2)),
        static_load=disc_mass_kg * 9.81 * np.ones(2),
        dofs=((1, "translation"), (2, "translation")),
        stiffness_loss={"stiffness_loss": (np.diag([1.0, 0.0]), "N/m", 0.1 * stiffness_N_per_m)},
    )
