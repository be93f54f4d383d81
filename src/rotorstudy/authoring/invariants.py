"""What every plugin of a kind must hold, one function a claim; `rotorstudy check` and the tests run the same list.

A check takes a plugin, says its claim in the first line of its docstring, and raises BrokenInvariant if it does not
hold. Tolerances have their reasons beside them.
"""

from dataclasses import replace

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError, UnidentifiableError
from rotorstudy.inference.fit import output_error_fit
from rotorstudy.inference.problem import Problem, estimate_by
from rotorstudy.measurement.records import harmonics_by
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.cracks import SAMPLES, crack_parameters, crack_series, opening_of, participation_factors
from rotorstudy.model.depth import compliance, depth_ratio_of, stiffness_loss
from rotorstudy.model.kinds import KINDS, Crack, Effect
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed
from rotorstudy.model.rig import build_model, make_term
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Entry, Parameter, Term, apply_entries
from rotorstudy.response.harmonic import harmonic_response, measured_response
from rotorstudy.response.integration import force_in_time, time_response
from rotorstudy.response.series import synthesize
from rotorstudy.response.statics import static_deflection

HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]
SPEEDS = [50.0, 88.0, 120.0, 150.0, 199.0]
SERIES_ORDER = 15
ROUND_OFF = 1e-9  # relative; some thousand products of numbers of 16 digits


class BrokenInvariant(AssertionError):
    """A plugin does not hold what its kind claims; the message says where and by how much."""


def claim(holds, message):
    if not holds:
        raise BrokenInvariant(message)


def kind_of(plugin):
    return next(name for name, kind in KINDS.items() if isinstance(plugin, kind))


# --- every plugin


def stated(plugin):
    """says in one line what it is, and where its equation comes from"""
    claim(plugin.summary, "the function has no docstring; its first line is what users see")
    claim(len(plugin.summary) < 120, f"the first line of the docstring has {len(plugin.summary)} characters; keep 120")
    claim(plugin.summary.endswith((".", ")")), "the first line of the docstring is no sentence with a full stop")
    claim(plugin.source, "no source; name the paper, book or equation")


def numbers_checked(plugin):
    """says which published or closed-form numbers it was checked against"""
    claim(len(plugin.checked) > 10, "'checked' is empty; name the numbers of the paper or closed form it agrees with")


# --- cracks

GRID = 40_000  # angles; a function with jumps has its Fourier sums wrong by the height of the jumps over the grid
OPENINGS = ("xi", "eta", "xi-eta")


def _angles():
    return (np.arange(GRID) + 0.5) * 2 * np.pi / GRID


def crack_is_bounded(plugin):
    """opens between 0 (shut) and 1 (open), along xi and eta"""
    openings = opening_of(plugin, _angles(), plugin.example)
    claim(np.isfinite(openings).all(), "the opening has NaN or infinite values")
    for name, opening in zip(OPENINGS[:2], openings, strict=False):
        low, high = opening.min(), opening.max()
        claim(low >= -1e-12 and high <= 1 + 1e-12, f"the opening along {name} goes from {low:.3g} to {high:.3g}")


def crack_never_stiffens(plugin):
    """takes stiffness away in every direction at every angle, nowhere more than the whole loss"""
    xi, eta, both = opening_of(plugin, _angles(), plugin.example)
    middle, radius = (xi + eta) / 2, np.hypot((xi - eta) / 2, both)
    low, high = (middle - radius).min(), (middle + radius).max()
    claim(low >= -1e-12, f"in some direction it adds {-low:.3g} of the loss: the loss matrix has a negative eigenvalue")
    claim(high <= 1 + 1e-12, f"in some direction it takes {high:.3g} times the loss")


def crack_is_periodic(plugin):
    """is the same after a turn"""
    angle = _angles()
    one, other = (opening_of(plugin, a, plugin.example) for a in (angle, angle + 2 * np.pi))
    off = np.abs(one - other).max()
    claim(off < ROUND_OFF, f"a turn later the opening differs by up to {off:.3g}")


def crack_is_symmetric(plugin):
    """opens as it shuts, if it claims so: xi and eta even in the angle, xi-eta odd"""
    if not plugin.symmetric:
        return
    angle = _angles()
    mirrored = opening_of(plugin, -angle, plugin.example) * np.array([1, 1, -1])[:, None]
    off = np.abs(opening_of(plugin, angle, plugin.example) - mirrored).max()
    claim(off < ROUND_OFF, f"opening and shutting differ by up to {off:.3g}")


def crack_series_is_the_function(plugin):
    """has a Fourier series that agrees with its form in time, mean included"""
    angle, series = _angles(), crack_series(plugin, SERIES_ORDER, plugin.example)
    openings = opening_of(plugin, angle, plugin.example)
    highest = max(abs(k) for k in series)
    claim(highest <= SERIES_ORDER, f"series({SERIES_ORDER}) gives coefficient {highest}")
    for k in range(-SERIES_ORDER, SERIES_ORDER + 1):
        numerical = np.mean(openings * np.exp(-1j * k * angle), axis=-1)
        told, mirrored = series.get(k, np.zeros(3)), np.conj(series.get(-k, np.zeros(3)))
        for name, one, other, back in zip(OPENINGS, told, numerical, mirrored, strict=True):
            claim(
                abs(one - other) < (2 / GRID if plugin.series else 2 / SAMPLES),
                f"coefficient {k} of the series along {name} is {one:.4g}, of the function {other:.4g}",
            )
            claim(
                abs(one - back) < 1e-13,
                f"coefficients {k} and {-k} along {name} are not conjugate: no real function has them",
            )


def crack_force_is_its_table(plugin):
    """pushes as the stiffness lost at each shaft angle says, at any position about the shaft"""
    structure, position, w = bench_structure(), 0.8, 88.0
    time = np.arange(256) * 2 * np.pi / w / 256
    (loss,) = crack_parameters(plugin, structure, False, SERIES_ORDER, angle_rad=position, **plugin.example)
    motion = np.exp(1j * np.outer(w * time, [0, 1, -1])) @ np.array([1.0, 0.5j, 0.3])
    angle = w * time + position
    turned = motion * np.exp(-1j * angle)
    series = crack_series(plugin, SERIES_ORDER, plugin.example)
    xi, eta, both = sum(np.outer(s, np.exp(1j * k * angle)) for k, s in series.items()).real
    expected = (xi * turned.real + both * turned.imag) + 1j * (both * turned.real + eta * turned.imag)
    force = force_in_time(loss.entries, w, time, motion[:, None])[:, 0]
    off = np.abs(force - expected * np.exp(1j * angle)).max()
    claim(off < ROUND_OFF, f"the force of one unit of loss differs by {off:.3g} N from the stiffness lost")
    still = apply_entries(
        crack_parameters(plugin, structure, True, SERIES_ORDER, **plugin.example)[0].entries,
        np.zeros((1, len(HARMONICS), 1), complex),
        np.array([w]),
        np.array(HARMONICS),
        np.ones(1),
    )
    off = np.abs(still[0, :, 0] - participation_factors(plugin, HARMONICS, SERIES_ORDER, plugin.example)).max()
    claim(off < ROUND_OFF, f"the participation factors differ by {off:.3g} from the weight-dominant force")


def crack_is_found_again(plugin):
    """is found again from what it does, with and without weight dominance: its stiffness loss from a start 30 % off"""
    structure = bench_structure()
    for dominance in (True, False):
        parameters = tuple(crack_parameters(plugin, structure, dominance, **plugin.example))
        check_round_trip(Term(plugin.name, parameters, {p.name: p.typical for p in parameters}), structure)


# --- depth of a crack

SHAFT = {"stiffness": 7.6e5, "span_m": 0.45}


def _depths(plugin):
    return np.linspace(*plugin.valid, 26)


def depth_is_monotone(plugin):
    """bends the shaft not at all at no depth, and ever more the deeper the crack, most along xi"""
    found = np.array([compliance(plugin, depth, **plugin.example) for depth in _depths(plugin)])
    claim(found.shape == (26, 2), f"it gives {found.shape[1:]} compliances, not one for xi and one for eta")
    claim(np.isfinite(found).all(), "a compliance within its range is not finite")
    if plugin.valid[0] == 0:
        claim(np.abs(found[0]).max() == 0, f"a crack of no depth has the compliance {found[0].max():.3g} rad/(N m)")
    claim((np.diff(found, axis=0) > 0).all(), "a deeper crack bends no more")
    claim((found[1:, 0] >= found[1:, 1]).all(), "it bends more along eta than along xi, its weak direction")


def depth_keeps_to_its_range(plugin):
    """refuses a depth outside the range it states"""
    low, high = plugin.valid
    claim(0 <= low < high <= 1, f"the range {low:g} to {high:g} is none of a depth over the diameter")
    for outside in (low - 0.01, high + 0.01, float("nan")):
        try:
            compliance(plugin, outside, **plugin.example)
        except RotorstudyError:
            continue
        raise BrokenInvariant(f"it takes the depth ratio {outside:g}")


def depth_comes_back(plugin):
    """comes back from the stiffness loss it means, and that is less than the whole stiffness"""
    for depth in _depths(plugin)[1:-1:4]:
        loss = stiffness_loss(plugin, depth, **SHAFT, **plugin.example)
        claim(0 < loss.eta <= loss.xi < SHAFT["stiffness"], f"depth {depth:.3g} takes {loss} of {SHAFT['stiffness']}")
        found = depth_ratio_of(plugin, loss.xi, **SHAFT, **plugin.example)
        claim(abs(found - depth) < 1e-9, f"depth {depth:.6g} comes back as {found:.6g}")


# --- rotors


def _example_structure(plugin):
    return build_model({"rotor": {"kind": plugin.name, **plugin.example}}).structure


def rotor_is_mechanical(plugin):
    """has real symmetric matrices, positive mass and no negative stiffness"""
    check_matrices(_example_structure(plugin))


def check_matrices(structure):
    size = len(structure.dofs)
    for name in ("mass", "stiffness", "gyroscopic"):
        matrix = getattr(structure, name)
        claim(matrix.shape == (size, size), f"{name} has shape {matrix.shape} for {size} coordinates")
        claim(np.isrealobj(matrix), f"{name} is not real")
        claim(np.array_equal(matrix, matrix.T), f"{name} is not symmetric")
    claim(np.linalg.eigvalsh(structure.mass).min() > 0, "the mass matrix is not positive definite")
    least, *_, most = [0.0, *np.linalg.eigvalsh(structure.stiffness)]
    claim(least >= -ROUND_OFF * most, f"the stiffness matrix has the negative eigenvalue {least:.3g}")


def rotor_weighs(plugin):
    """has a static load that weighs"""
    check_load(_example_structure(plugin))


def check_load(structure):
    load = structure.static_load
    claim(load.shape == (len(structure.dofs),), f"the static load has shape {load.shape}")
    claim(load.sum() > 0, "the static load is zero or upward; gravity points along +x")


def rotor_losses_take_away(plugin):
    """states stiffness losses that take stiffness away, with unit and typical size"""
    structure = _example_structure(plugin)
    size = len(structure.dofs)
    for node in structure.nodes if callable(structure.stiffness_loss) else (None,):
        for name, (pattern, unit, typical) in structure.stiffness_loss_at(node).items():
            claim(pattern.shape == (size, size), f"{name} has a pattern of shape {pattern.shape}")
            claim(np.linalg.eigvalsh(pattern).min() >= 0, f"{name} adds stiffness")
            claim(unit and typical > 0, f"{name} lacks its unit or typical size")


# --- effects and bearings


def bench_structure():
    """One mass on a shaft, 2 kg and 98 Hz: what effects and bearings are tried on."""
    stiffness = 7.6e5
    return Structure(
        mass=np.array([[2.0]]),
        stiffness=np.array([[stiffness]]),
        gyroscopic=np.zeros((1, 1)),
        static_load=np.array([2.0 * 9.81]),
        dofs=((1, "translation"),),
        stiffness_loss={"stiffness_loss": (np.eye(1), "N/m", 0.3 * stiffness)},
    )


def tilting_bench():
    """The same mass as a disc that tilts and turns with it, off mid-span: for effects on the tilt."""
    return replace(
        bench_structure(),
        mass=np.diag([2.0, 0.0024]),
        stiffness=np.array([[7.6e5, 3e4], [3e4, 1.2e4]]),
        gyroscopic=np.diag([0.0, 0.0036]),
        static_load=np.array([2.0 * 9.81, 0.0]),
        dofs=((1, "translation"), (1, "tilt")),
        stiffness_loss={"stiffness_loss": (np.diag([1.0, 0.0]), "N/m", 0.3 * 7.6e5)},
    )


def bench_terms(structure):
    """A damper and a crack, known: so that the rotor vibrates at all harmonics."""
    here = np.diag(np.diag(structure.mass) / structure.mass[0, 0])
    damping = Parameter("damping", "N s/m", (Entry(-here, order=1),), typical=100.0)
    opening = {k: np.sinc(k / 2) / 2 for k in range(-SERIES_ORDER, SERIES_ORDER + 1)}  # half a turn open
    crack = Crack("bench", None, source="", series=lambda order: {k: s for k, s in opening.items() if abs(k) <= order})
    loss = crack_parameters(crack, structure)
    return (
        Term("bench_damping", (damping,), {"damping": 90.0}, label="bench"),
        Term("bench_crack", tuple(loss), {p.name: 0.13 * 7.6e5 for p in loss}, label="bench"),
    )


def places_of(plugin, structure, sensors):
    """Options of each place that an effect offers on a rotor; a bearing stands where it is put."""
    return plugin.places(structure, sensors) if isinstance(plugin, Effect) else [{}]


def bench_of(plugin):
    """The first bench rotor that a plugin has a place on, and the options of that place."""
    for structure in (bench_structure(), tilting_bench()):
        found = places_of(plugin, structure, structure.nodes)
        if found:
            return structure, found[0]
    raise BrokenInvariant("it offers no place on a rotor that moves, tilts, turns, weighs and can crack")


def typical_term(plugin, structure, place=None):
    """An effect or bearing at a place (its own by default), every parameter with its typical size."""
    item = {"kind": plugin.name, **(place or {}), **plugin.example}
    term = make_term(kind_of(plugin), item, structure, structure.nodes)
    values = {p.name: p.typical * (np.exp(0.6j) if p.is_complex else 1) for p in term.parameters}
    return replace(term, values=values)


def effect_offers_places(plugin):
    """offers places it can act at, each once"""
    bench_of(plugin)
    for structure in (bench_structure(), tilting_bench()):
        found = places_of(plugin, structure, structure.nodes)
        claim(all(found.count(place) == 1 for place in found), f"it offers a place twice: {found}")
        for place in found:
            try:
                typical_term(plugin, structure, place)
            except RotorstudyError as error:
                raise BrokenInvariant(f"it cannot act at its own place {place}: {error}") from None


def effect_shape_is_open(plugin):
    """searches its shape options in ranges that hold their defaults"""
    import inspect

    known = inspect.signature(plugin.function).parameters
    for name, (low, high) in plugin.shape.items():
        claim(name in known, f"shape '{name}' is no option of the function")
        claim(low < high, f"shape '{name}' has the range {low:g} to {high:g}")
        default = known[name].default
        claim(low <= default <= high, f"shape '{name}' has the default {default} outside {low:g} to {high:g}")


def term_states_units(plugin):
    """states unit and typical size of every parameter"""
    check_units(typical_term(plugin, *bench_of(plugin)))


def check_units(term):
    claim(term.parameters, "it has no parameters")
    for parameter in term.parameters:
        claim(parameter.unit, f"{parameter.name} has no unit; write '1' for a pure number")
        claim(parameter.typical > 0, f"{parameter.name} has the typical size {parameter.typical}; give one above zero")


def term_is_one_table(plugin):
    """means in frequency what it means in time, or says that it has no form in time"""
    structure, place = bench_of(plugin)
    term = typical_term(plugin, structure, place)
    if any(unknown.force for unknown in term.unknowns):
        check_steady_state(term, structure)
    else:
        check_table(term, len(structure.nodes if term.acts_on == "output" else structure.dofs))


def check_steady_state(term, structure):
    """Harmonic balance agrees with integration in time, and the force is felt."""
    bench = Model(structure, bench_terms(structure))
    model, w = bench.plus(term), SPEEDS[1]
    harmonics = np.arange(-SERIES_ORDER, SERIES_ORDER + 1)
    found, without = (harmonic_response(m, [w], harmonics)[0] for m in (model, bench))
    sampled = (2 + np.arange(128) / 128) * 2 * np.pi / w  # what is no steady state loses 96 % of its error till then
    start = (found.sum(axis=0), 1j * w * harmonics @ found)
    moved = time_response(model, w, sampled, start=start, relative_tolerance=1e-8)
    seen = (np.fft.fft(moved, axis=0) / len(sampled))[harmonics]
    off, size = np.abs(found - seen).max(), np.abs(found - without).max()
    # a contact that sets in suddenly has harmonics beyond those carried, which fall with the cube of their number
    claim(
        off < 1e-2 * size,
        f"its steady state in harmonics and integrated in time differ by {off:.3g} m, of {size:.3g} m that it does",
    )


def check_table(term, dof):
    generator = np.random.default_rng(1)
    w, harmonics = 88.0, np.arange(-9, 10)
    time = np.arange(128) * 2 * np.pi / w / 128
    amplitude = np.zeros((1, len(harmonics), dof), complex)
    amplitude[:, 7:12] = generator.normal(size=(1, 5, dof)) + 1j * generator.normal(size=(1, 5, dof))
    turning = np.exp(1j * harmonics * w * time[:, None])
    motion = [turning * (1j * harmonics * w) ** order @ amplitude[0] for order in range(3)]
    still = generator.normal(size=dof) + 1j * generator.normal(size=dof)
    motion[0] = motion[0] + still
    for unknown in term.unknowns:
        column = apply_entries(unknown.entries, amplitude, np.array([w]), harmonics, still)[0]
        if any(entry.frequency_only for entry in unknown.entries):
            try:
                force_in_time(unknown.entries, w, time, *motion)
            except RotorstudyError:
                continue
            raise BrokenInvariant(f"{unknown.name} exists in frequency only, yet gives a force in time")
        force = force_in_time(unknown.entries, w, time, *motion, deflection=still)
        seen = (np.fft.fft(force, axis=0) / len(time))[harmonics]
        off = np.abs(column - seen).max()
        claim(
            off <= 1e-10 * np.abs(seen).max(),
            f"the force of {unknown.name} in frequency and in time differ by {off:.3g} N",
        )


def term_is_found_again(plugin):
    """is found again from what it does: simulated, then identified from a start 30 % off"""
    structure, place = bench_of(plugin)
    check_round_trip(typical_term(plugin, structure, place), structure)


def check_round_trip(term, structure):
    model = Model(structure, (*bench_terms(structure), term))
    shown = measured_response(model, SPEEDS, HARMONICS)
    spectrum = _sure_spectrum(model, shown)
    names = tuple(unknown.name for unknown in term.unknowns)
    true = model.theta[model.position(names)]
    try:
        found = output_error_fit(Problem(model, spectrum, names), start=1.3 * true).theta
    except RotorstudyError as error:
        raise BrokenInvariant(str(error)) from None
    off = np.abs(found - true).max() / np.abs(true).max()
    claim(off < 1e-6, f"identified {dict(zip(names, found, strict=True))}, simulated with {true}")


def _sure_spectrum(model, shown, std=1e-9):
    covariance = independent_covariance(np.full(np.shape(shown)[-3:], std) ** 2)
    return Spectrum(shown, np.array(SPEEDS), np.array(HARMONICS), model.sensors, covariance)


# --- bearings

BEARING_HARMONICS = [1, 2, 3]


def bearing_is_finite(plugin):
    """is finite at speeds of a laboratory rotor"""
    check_finite(typical_term(plugin, bench_structure()))


def check_finite(term):
    found = dynamic_stiffness(term, SPEEDS, BEARING_HARMONICS)
    bad = [w for w, one in zip(SPEEDS, found, strict=True) if not np.isfinite(one).all()]
    claim(not bad, f"stiffness or damping is not finite at {', '.join(f'{w:g}' for w in bad)} rad/s")


def bearing_carries(plugin):
    """carries a free shaft's weight, which then rests a finite way down"""
    structure = replace(bench_structure(), stiffness=np.zeros((1, 1)))
    check_carries(typical_term(plugin, structure), structure)


def check_carries(term, structure):
    model = Model(structure, (term,))
    try:
        deflection = static_deflection(model, SPEEDS, model.theta).value
    except np.linalg.LinAlgError:
        raise BrokenInvariant("it has no stiffness at rest: the shaft falls through") from None
    down = np.real(deflection @ structure.static_load)
    claim(np.isfinite(down).all(), "it has no stiffness at rest: the shaft falls through")
    claim((down > 0).all(), f"the shaft rises against its weight at {np.array(SPEEDS)[down <= 0]} rad/s")


def bearing_is_what_it_claims(plugin):
    """has the positive damping and the symmetry that it claims"""
    term = typical_term(plugin, bench_structure())
    if plugin.positive_damping:
        check_positive_damping(term)
    if plugin.symmetric:
        check_symmetric(term)


def check_positive_damping(term):
    loss = dynamic_stiffness(term, SPEEDS, BEARING_HARMONICS).imag
    least = np.linalg.eigvalsh(loss + np.swapaxes(loss, -1, -2)).min()
    claim(least > 0, f"a motion gains energy from its damping: {least / 2:.3g} N/m in quadrature")


def check_symmetric(term):
    found = dynamic_stiffness(term, SPEEDS, BEARING_HARMONICS)
    off = np.abs(found - np.swapaxes(found, -1, -2)).max()
    claim(off <= ROUND_OFF * np.abs(found).max(), f"xy and yx differ by {off:.3g} N/m: they feed a whirl")


# --- spectra

SPECTRUM_TRIALS = 300
TURN_SPEED = 100.0  # rad/s


def _bench_record(turns=6.0, seed=3):
    """Turns of nine harmonics, a hundred samples each: time, amplitude (harmonic,), signal."""
    generator = np.random.default_rng(seed)
    time = np.arange(int(100 * turns)) * (2 * np.pi / TURN_SPEED / 100)
    amplitude = generator.normal(size=len(HARMONICS)) + 1j * generator.normal(size=len(HARMONICS))
    return time, amplitude, synthesize(amplitude, TURN_SPEED, HARMONICS, time)


def _harmonics_by(plugin, signal, time, speed=TURN_SPEED):
    """With exact marks, the first of them at the first sample: then the phase counts from both."""
    marks = np.arange(0, time[-1], 2 * np.pi / TURN_SPEED)
    return harmonics_by(plugin, signal, time, speed, HARMONICS, marks)


def _claim_exact(amplitude, true, tolerance=1e-9):
    off = np.abs(amplitude - true)
    worst = int(off.argmax())
    claim(off.max() < tolerance, f"harmonic {HARMONICS[worst]} is off by {off[worst]:.3g} of 1")


def spectrum_is_exact(plugin):
    """gives the harmonics of a record of whole turns without noise, phase from the first sample"""
    time, true, signal = _bench_record()
    amplitude, covariance = _harmonics_by(plugin, signal[None], time)
    size = len(HARMONICS)
    claim(amplitude.shape == (1, size), f"amplitudes of shape {amplitude.shape}, not {(1, size)}")
    needed = (1, 2 * size, 2 * size)
    claim(covariance.shape == needed, f"covariance of shape {covariance.shape}, not {needed}")
    _claim_exact(amplitude[0], true)


def spectrum_covariance_is_honest(plugin):
    """states the covariance that its harmonics scatter with under white noise"""
    time, _, signal = _bench_record()
    x, y = 0.1 * np.random.default_rng(4).normal(size=(2, SPECTRUM_TRIALS, len(time)))
    amplitude, stated = _harmonics_by(plugin, signal + x + 1j * y, time)
    # the mean variance of 18 components over 300 trials is known to 2 %, the stated noise floor to 5 % a record
    _claim_honest(np.concatenate([amplitude.real, amplitude.imag], axis=-1), stated, 0.1)


def _claim_honest(found, stated, tolerance):
    scatter, stated = np.cov(np.transpose(found)), np.mean(stated, axis=0)
    ratio = np.trace(stated) / np.trace(scatter)
    claim(abs(ratio - 1) < tolerance, f"stated variance is {ratio:.3g} times the scatter of {len(found)} trials")
    off = np.abs(stated - scatter).max() / np.diag(scatter).mean()
    claim(off < 0.45 * max(1, np.diag(scatter).max() / np.diag(scatter).mean()),
          f"an element of the stated covariance is off by {off:.2g} of the mean variance")  # fmt: skip


def spectrum_is_exact_at_any_length(plugin):
    """if it says so: gives the harmonics of a record of incomplete turns"""
    if plugin.any_length:
        time, true, signal = _bench_record(turns=5.7)
        _claim_exact(_harmonics_by(plugin, signal, time)[0], true)


def spectrum_tolerates_wrong_speed(plugin):
    """if it says so: gives the harmonics of a record whose stated speed is off by a thousandth"""
    if plugin.tolerates_wrong_speed:
        time, true, signal = _bench_record(turns=40)
        for wrong in (0.999, 1.001):
            _claim_exact(_harmonics_by(plugin, signal, time, wrong * TURN_SPEED)[0], true)


def spectrum_tolerates_outliers(plugin):
    """if it says so: is not drawn off by spikes, all upward, in two samples of a hundred"""
    if plugin.tolerates_outliers:
        time, true, signal = _bench_record(turns=20)
        generator, std = np.random.default_rng(5), 0.01
        x, y = std * generator.normal(size=(2, len(time)))
        spikes = 100 * std * (generator.random(len(time)) < 0.02)
        amplitude, _ = _harmonics_by(plugin, signal + x + 1j * y + spikes, time)
        _claim_exact(amplitude, true, 6 * std / np.sqrt(len(time)))  # six standard deviations without any spikes


def spectrum_follows_the_marks(plugin):
    """if it uses marks: gives the harmonics of a shaft whose speed drifts, and states what jitter of the marks does"""
    if not plugin.uses_marks:
        return
    time, true, _ = _bench_record(turns=21)
    drift = 0.05 / time[-1]  # the speed rises by a tenth
    signal = synthesize(true, TURN_SPEED, HARMONICS, time * (1 + drift * time))
    turned = np.arange(20) * 2 * np.pi / TURN_SPEED
    marks = 2 * turned / (1 + np.sqrt(1 + 4 * drift * turned))  # where time * (1 + drift * time) = turned
    found = harmonics_by(plugin, signal, time, TURN_SPEED, HARMONICS, marks)[0]
    _claim_exact(found, true, 1e-3)  # a cubic spline over pieces of ten turns; without it every harmonic is lost
    jitter = 1e-3 / TURN_SPEED * np.random.default_rng(6).normal(size=(SPECTRUM_TRIALS, len(marks)))
    trials = [harmonics_by(plugin, signal, time, TURN_SPEED, HARMONICS, marks + late) for late in jitter]
    amplitude, stated = (np.array(part) for part in zip(*trials, strict=True))
    # one error a mark: fewer than ten independent ones in 300 trials, so a variance is known to 8 %, here three times
    _claim_honest(np.concatenate([amplitude.real, amplitude.imag], axis=-1), stated, 0.25)


# --- estimators


def _bench_problem():
    """Damping inside and outside, unbalance and crack of the bench rotor, at five speeds, all unknown."""
    structure = bench_structure()
    here, (damping, crack) = np.eye(1), bench_terms(structure)
    internal = Parameter("inner", "N s/m", (Entry(-here, order=1), Entry(1j * here, gain=lambda w: w)), 20.0)
    unbalance = Parameter(
        "unbalance", "m", (Entry(np.array([2.0]), on="one", shift=1, gain=lambda w: w**2),), 1e-5, is_complex=True
    )
    terms = (damping, crack, Term("bench_inner", (internal,), {"inner": 20.0}))
    model = Model(structure, (*terms, Term("bench_unbalance", (unbalance,), {"unbalance": 5e-6 * np.exp(0.5j)})))
    shown = measured_response(model, SPEEDS, HARMONICS)
    return Problem(model, _sure_spectrum(model, shown), model.names)


def estimator_is_exact(plugin):
    """finds the truth in data without noise, of one spectrum and of many at once"""
    problem = _bench_problem()
    shown, true = problem.spectrum.amplitude, problem.model.theta
    for amplitude in (shown, np.stack([shown, shown])):
        found = estimate_by(plugin, replace(problem, spectrum=problem.spectrum.with_amplitude(amplitude)))
        needed = (*amplitude.shape[:-3], len(true))
        claim(np.shape(found.theta) == needed, f"theta of shape {np.shape(found.theta)}, not {needed}")
        claim(np.isfinite(found.std).all() and np.isfinite(found.theta).all(), "theta or its covariance is not finite")
        off = np.abs(found.theta / true - 1)
        claim(off.max() < 1e-8, f"{problem.names[off.argmax() % len(true)]} is off by {off.max():.3g} of its value")


ESTIMATOR_TRIALS = 300
BENCH_LEVEL = 2e-3  # of each harmonic: its square, that draws equation errors off, does not show


def _noisy_bench():
    """The bench problem under independent noise on each harmonic, many trials."""
    problem = _bench_problem()
    spectrum, generator = problem.spectrum, np.random.default_rng(7)
    std = BENCH_LEVEL * np.abs(spectrum.amplitude) / np.sqrt(2)
    x, y = generator.normal(size=(2, ESTIMATOR_TRIALS, *std.shape))
    noisy = replace(spectrum, amplitude=spectrum.amplitude + std * (x + 1j * y))
    return replace(problem, spectrum=replace(noisy, covariance=independent_covariance(std**2)))


def _of_trial(problem, trial=0):
    return replace(problem, spectrum=problem.spectrum.with_amplitude(problem.spectrum.amplitude[trial]))


def estimator_covariance_is_honest(plugin):
    """states the covariance that its estimates scatter with, and 95 % intervals that hold the truth"""
    problem = _noisy_bench()
    found, true = estimate_by(plugin, problem), problem.model.theta
    errors = found.theta - true
    stated = np.broadcast_to(found.covariance, (*errors.shape, len(true)))
    # variances of 300 trials scatter by 8 %: five times that for each unknown, and 3.3 % for all six together
    for name, ratio in zip(problem.names, np.diagonal(stated.mean(axis=0)) / errors.var(axis=0), strict=True):
        claim(0.65 < ratio < 1.5, f"stated variance of {name} is {ratio:.3g} times the scatter")
    root = np.linalg.cholesky(stated / _outer(found.std))
    whitened = np.linalg.solve(root, (errors / found.std)[..., None])
    ratio = np.mean(whitened**2)
    claim(abs(ratio - 1) < 0.17, f"errors have {ratio:.3g} times the stated variance, correlations counted")
    share = np.mean(np.abs(errors) <= 1.959964 * found.std)
    claim(abs(share - 0.95) < 0.03, f"95 % intervals hold the truth in {100 * share:.1f} % of the trials")


def _outer(std):
    return std[..., :, None] * std[..., None, :]


def estimator_uses_covariance(plugin):
    """counts noisier harmonics less if it says so, and not otherwise"""
    problem = _of_trial(_noisy_bench())
    spectrum = problem.spectrum
    loud = np.where(np.arange(2 * len(HARMONICS)) % len(HARMONICS) == HARMONICS.index(2), 10.0, 1.0)
    doubted = replace(spectrum, covariance=spectrum.covariance * np.outer(loud, loud))
    one, other = (estimate_by(plugin, replace(problem, spectrum=s)) for s in (spectrum, doubted))
    moved = np.abs((other.theta - one.theta) / one.std).max()
    if plugin.uses_covariance:
        claim(moved > 1e-3, "the estimate does not change when a harmonic is stated to be ten times noisier")
    else:
        claim(moved < 1e-6, f"the covariance moves the estimate by {moved:.2g} deviations: say uses_covariance")


def estimator_fits_output(plugin):
    """finds an offset of the sensor if it says so, and refuses it otherwise"""
    problem = _bench_problem()
    gap = Parameter("gap", "m", (Entry(np.array([1.0]), on="one"),), 1e-5)
    model = problem.model.plus(Term("bench_gap", (gap,), {"gap": 2e-5}, label="gap", acts_on="output"))
    shown = measured_response(model, SPEEDS, HARMONICS)
    problem = Problem(model, _sure_spectrum(model, shown), model.names)
    if plugin.fits_output:
        off = np.abs(estimate_by(plugin, problem).theta / model.theta - 1).max()
        claim(off < 1e-6, f"with an offset of the sensor unknown too, an estimate is off by {off:.3g} of its value")
    else:
        _claim_refused(plugin, problem, "an offset of the sensor", RotorstudyError)


def estimator_handles_rank_deficiency(plugin):
    """gives what is determined beside two unknowns that trade off if it says so, and refuses otherwise"""
    problem = _bench_problem()
    model = problem.model.plus(replace(problem.model.terms[0], label="confounder", values={}))
    (confounder,) = set(model.names) - set(problem.names)
    doubled = replace(problem, model=model, names=(*problem.names, confounder))
    if not plugin.handles_rank_deficiency:
        _claim_refused(plugin, doubled, "two unknowns that trade off", UnidentifiableError)
        return
    found, open_ones = estimate_by(plugin, doubled), np.isin(doubled.names, (problem.names[0], confounder))
    off = np.abs(found.theta[~open_ones] / problem.model.theta[1:] - 1).max()  # all but the one with a confounder
    claim(off < 1e-4, f"beside two unknowns that trade off, another is off by {off:.3g} of its value")
    sure = found.std[open_ones] < 0.1 * problem.model.typical[0]
    claim(not sure.any(), "states a small deviation of unknowns that trade off")


def _claim_refused(plugin, problem, what, error):
    try:
        estimate_by(plugin, problem)
    except PluginError:
        raise
    except error:
        return
    raise BrokenInvariant(f"takes {what} without an error, yet does not say that it can")


def estimator_tolerates_outliers(plugin):
    """if it says so: is not drawn off by one harmonic that is wrong by fifty standard deviations"""
    if not plugin.tolerates_outliers:
        return
    problem = _noisy_bench()
    amplitude = problem.spectrum.amplitude[:50].copy()
    amplitude[:, 2, HARMONICS.index(1)] *= 1 + 50 * BENCH_LEVEL / np.sqrt(2)
    problem = replace(problem, spectrum=problem.spectrum.with_amplitude(amplitude))
    found = estimate_by(plugin, problem)
    off = np.abs((found.theta - problem.model.theta).mean(axis=0) / found.std.mean(axis=0)).max()
    claim(off < 1.5, f"an outlier of fifty standard deviations moves an estimate by {off:.2g} of its own")


INVARIANTS = {
    "rotor": (rotor_is_mechanical, rotor_weighs, rotor_losses_take_away),
    "crack": (
        crack_is_bounded,
        crack_never_stiffens,
        crack_is_periodic,
        crack_is_symmetric,
        crack_series_is_the_function,
        crack_force_is_its_table,
        crack_is_found_again,
    ),
    "depth": (depth_is_monotone, depth_keeps_to_its_range, depth_comes_back),
    "bearing": (
        term_states_units,
        term_is_one_table,
        term_is_found_again,
        bearing_is_finite,
        bearing_carries,
        bearing_is_what_it_claims,
    ),
    "effect": (
        effect_offers_places,
        effect_shape_is_open,
        term_states_units,
        term_is_one_table,
        term_is_found_again,
    ),
    "spectrum": (
        spectrum_is_exact,
        spectrum_covariance_is_honest,
        spectrum_is_exact_at_any_length,
        spectrum_tolerates_wrong_speed,
        spectrum_tolerates_outliers,
        spectrum_follows_the_marks,
    ),
    "estimator": (
        estimator_is_exact,
        estimator_covariance_is_honest,
        estimator_uses_covariance,
        estimator_fits_output,
        estimator_handles_rank_deficiency,
        estimator_tolerates_outliers,
    ),
}


def invariants_of(plugin):
    """The checks a plugin must pass, in order."""
    return (stated, numbers_checked, *INVARIANTS[kind_of(plugin)])


def broken_invariants(plugin):
    """What does not hold: claim -> what was found instead; empty for a good plugin. Any error counts as broken."""
    broken = {}
    for check in invariants_of(plugin):
        try:
            check(plugin)
        except Exception as error:
            said = " ".join(str(error).split()) or type(error).__name__
            told = isinstance(error, (BrokenInvariant, RotorstudyError))
            broken[check.__doc__] = said if told else blamed(error) or f"{type(error).__name__}: {said}"
    return broken
