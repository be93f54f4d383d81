import numpy as np

from rotorstudy.plugins import NonNegative, Positive, Rotor, Structure


@Rotor(
    source="Jeffcott 1919; thesis Eqs. (2.7), (2.18)",
    checked="response and estimates of thesis Tables 2.2 and 2.3, 18 of 18 printed regression values",
    uncertain={"stiffness_N_per_m": 0.005},
    example={"mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
)
def jeffcott(mass_kg: Positive, stiffness_N_per_m: Positive, gravity_m_per_s2: NonNegative = 9.81):
    """Disc at mid-span of a massless shaft on rigid bearings: m z'' + k z = m g (two real degrees of freedom)."""
    return Structure(
        mass=np.array([[mass_kg]]),
        stiffness=np.array([[stiffness_N_per_m]]),
        gyroscopic=np.zeros((1, 1)),
        static_load=np.array([mass_kg * gravity_m_per_s2]),
        dofs=((1, "translation"),),
        stiffness_loss={"stiffness_loss": (np.eye(1), "N/m", 0.3 * stiffness_N_per_m)},
        gravity=gravity_m_per_s2,
    )
