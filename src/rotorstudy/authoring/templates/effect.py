import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
)
def my_model(structure, node: int | None = None):
    """Drag that grows with the spin speed: force -c (w / 100) dz/dt, w in rad/s."""
    # Arguments after `structure` are options in the rig file; put the unit of a number in its name, as `length_m`.
    here = structure.unit(node)
    # An entry is a force: matrix @ (d/dt)^order of z, of its conjugate (on="conj") or of a constant (on="one").
    # gain=lambda speed: ... makes it depend on the spin speed in rad/s, shift=k multiplies it by e^{jkwt}.
    drag = Entry(-np.outer(here, here), order=1, gain=lambda speed: speed / 100)
    # What is typical is a share of a size of the rotor, so that it holds for small and large ones.
    return [Parameter("drag", "N s/m", (drag,), typical=0.02 * structure.scales.critical_damping(node))]
