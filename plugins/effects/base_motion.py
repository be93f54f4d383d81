import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Newton, in a frame that accelerates; Genta 2005, Dynamics of Rotating Systems",
    places=lambda structure, sensors: [{"harmonic": n} for n in (1, -1, 2, -2)],
    parts=("harmonic",),
    checked="motion solved in the frame at rest to 1e-9",
    confounders={
        "unbalance": "base motion accelerates all masses alike; equal on a rotor of one mass: measure the base"
    },
)
def base_motion(structure, harmonic: int = 1):
    """Foundation that carries the probes and moves by z_b at a harmonic: force m n^2 w^2 z_b on every mass.

    Displacements are relative to the base, whose amplitude is the same at all speeds.
    """
    along = np.array([float(motion == "translation") for _, motion in structure.dofs])
    entry = Entry(structure.mass @ along, on="one", shift=harmonic, gain=lambda speed: (harmonic * speed) ** 2)
    return [Parameter(f"base_motion_{harmonic}X", "m", (entry,), 0.2 * structure.scales.length, is_complex=True)]
