from rotorstudy.plugins import Effect, Entry, Parameter, unknown_name

THESIS_HARMONICS = (0, 1, 2, 3, 5, 7, -1, -3, -5)


@Effect(
    source="thesis Eqs. (2.19), (2.20), (3.2)",
    candidate=False,
    checked="equal to a crack plugin with the same participation factors to 1e-12",
)
def crack_force(
    structure,
    participation: dict[int, float] | None = None,
    harmonics: list[int] = THESIS_HARMONICS,
    losses: list[str] | None = None,
    node: int | None = None,
    element: int | None = None,
):
    """Weight-dominant crack force dk p_n u_0 e^{jnwt}, with p_n given, or with dk p_n free at each harmonic.

    losses: names of the stiffness losses of the rotor to use; all by default.
    """
    parameters = []
    possible = structure.stiffness_loss_at(node, element)
    for name in possible if losses is None else losses:
        if name not in possible:
            raise unknown_name("stiffness loss", name, possible, "crack_force")
        pattern, unit, typical = possible[name]
        if participation is None:
            entries = {n: (Entry(pattern, on="static", shift=n),) for n in harmonics}
            parameters += [Parameter(f"{name}_p{n}", unit, e, typical=0.1 * typical) for n, e in entries.items()]
        else:
            entries = tuple(Entry(p * pattern, on="static", shift=n) for n, p in participation.items())
            parameters.append(Parameter(name, unit, entries, typical=typical))
    return parameters
