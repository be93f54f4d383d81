from rotorstudy.plugins import Effect, NonNegative, Parameter, Positive, at_supports, outer, planar_entries


@Effect(
    source="Kirk and Gunter 1972, effect of support flexibility and damping; two dynamic stiffnesses in series",
    shape={
        "natural_frequency_rad_per_s": (0.1, 10.0, "frequency"),
        "frequency_ratio": (0.4, 2.5),
        "damping_ratio": (0.005, 0.5),
        "bearing_time_s": (0.0, 1.0, "time"),
    },
    places=at_supports,
    positive=("stiffness_loss_at_rest_xx", "stiffness_loss_at_rest_yy"),
    checked="a rotor on flexible_pedestal, with and without damping of the bearing, to 1e-10",
    confounders={
        "support_stiffness": "equal far below its resonance; tap the pedestal, or measure its motion",
        "support_anisotropy": "equal far below its resonance; tap the pedestal, or measure its motion",
    },
)
def pedestal_resonance(
    structure,
    node: int | None = None,
    natural_frequency_rad_per_s: Positive = 300.0,
    frequency_ratio: Positive = 1.0,
    damping_ratio: Positive = 0.05,
    bearing_time_s: NonNegative = 0.0,
):
    """Support that yields at resonances of its own along x and y.

    At the frequency v = n w a bearing b = k_b + j v c_b on a pedestal p = k_p + j v c_p - v^2 m passes on b p / (b + p)
    along each direction: it loses b^2 / (b + p) = k (1 + j v T)^2 r with r = w0^2 / (w0^2 - v^2 + 2j zeta w0 v), where
    T = c_b / k_b, k = k_b^2 / (k_b + k_p), w0^2 = (k_b + k_p) / m and 2 zeta w0 = (c_b + c_p) / m. w0 is the natural
    frequency along x; along y it is that times the ratio. Of cross stiffnesses of the bearing k (1 + j v T) (r_x + r_y)
    / 2 is lost, to first order in k_b / (k_b + k_p). It is defined in the frequency domain.
    """
    here = structure.unit(node)
    pattern, local = outer(here), structure.scales.stiffness(node)

    def passed(speed, harmonic):
        return 1 + 1j * harmonic * speed * bearing_time_s

    def resonance(speed, harmonic, ratio=1.0):
        share = harmonic * speed / (ratio * natural_frequency_rad_per_s)
        return 1 / (1 - share**2 + 2j * damping_ratio * share)

    def along_x(*at):
        return passed(*at) ** 2 * resonance(*at)

    def along_y(*at):
        return passed(*at) ** 2 * resonance(*at, frequency_ratio)

    def both(*at):
        return passed(*at) * (resonance(*at) + resonance(*at, frequency_ratio)) / 2

    direct, across = {"typical": 0.03 * local}, {"typical": 0.007 * local, "default": 0.0}
    return [
        Parameter(
            f"stiffness_loss_at_rest_{direction}",
            "N/m",
            planar_entries(direction, pattern, gain=gain, frequency_only=True),
            **(direct if gain is not both else across),
        )
        for direction, gain in (("xx", along_x), ("yy", along_y), ("xy", both), ("yx", both))
    ]
