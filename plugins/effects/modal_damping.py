import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Clough and Penzien 1993, Dynamics of Structures, section 12-3",
    candidate=False,
    positive=True,
    checked="the stated damping ratio in every mode of a shaft at standstill, to 1e-9",
)
def modal_damping(structure):
    """Damping to ground with one damping ratio in every mode: force -M P 2 z W P^T M dz/dt.

    P and W are the modes of unit modal mass and the natural frequencies at standstill, on the mean stiffness of the
    bearings in x and y. It does not rotate; damping of the shaft itself does, see `shaft_damping`.
    """
    from scipy.linalg import eigh

    squares, modes = eigh(structure.supported_stiffness, structure.mass)
    momenta = structure.mass @ modes
    pattern = momenta * (2 * np.sqrt(np.maximum(squares, 0))) @ momenta.T
    return [Parameter("damping_ratio", "1", (Entry(-pattern, order=1),), typical=0.01)]
