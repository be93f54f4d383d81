import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Zorzi and Nelson 1977; Genta 2005, Dynamics of Rotating Systems",
    positive=True,
    checked="the same force at every speed to 1e-6; its sign changes at n = 1",
    confounders={"shaft_damping": "equal at one harmonic of one speed; only viscous damping grows with the speed"},
)
def hysteretic_damping(structure):
    """Rate-independent material damping of the shaft: force -j eta sign(n - 1) K q_n."""

    def gain(speed, harmonic):
        return np.sign(harmonic - 1) + 0 * speed

    entry = Entry(-1j * structure.stiffness, gain=gain, frequency_only=True)
    return [Parameter("loss_factor", "1", (entry,), typical=0.01)]
