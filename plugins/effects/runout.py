from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl, sensor_unit


def runout(sensors, node: int | None = None, harmonic: int = 1):
    """Surface the probes see as motion: the same harmonic added at all speeds."""
    entry = Entry(sensor_unit(sensors, node), on="one", shift=harmonic)
    return [Parameter(f"runout_{harmonic}X", "m", (entry,), typical=1e-6, is_complex=True)]


def usual_harmonics(structure, sensors):
    """1X to 3X forward, 1X and 2X backward, of each sensor."""
    return [{"node": node, "harmonic": n} for node in sensors for n in (1, 2, 3, -1, -2)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "runout",
        runout,
        source="API 670; thesis Eq. (3.1)",
        acts_on="output",
        places=usual_harmonics,
        checked="the same harmonic at every speed to 1e-12",
        confounders=(
            ("unbalance", "a runout is the same at all speeds and does not resonate"),
            ("bow", "equal at slow roll; a bow resonates at the critical speed, a runout does not"),
            (
                "surface_profile",
                "both probes see a profile, y a quarter turn later, which ties backward to forward harmonics",
            ),
            ("parallel_misalignment", "a runout does not resonate where harmonic n meets a natural frequency"),
        ),
    )
