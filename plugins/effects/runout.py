from rotorstudy.model import sensor_unit
from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.terms import Entry, Parameter


def runout(sensors, node: int | None = None, harmonic: int = 1):
    """Surface the probes see as motion: the same harmonic added at all speeds."""
    entry = Entry(sensor_unit(sensors, node), on="one", shift=harmonic)
    return [Parameter(f"runout_{harmonic}X", "m", (entry,), typical=1e-6, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "runout",
        runout,
        source="API 670; thesis Eq. (3.1)",
        acts_on="output",
        twins=(("bow", "equal at slow roll; a bow resonates at the critical speed, a runout does not"),),
    )
