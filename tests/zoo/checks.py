"""What every plugin of a kind must keep, as functions that raise AssertionError. They know no plugin by name."""

import inspect

import numpy as np

from rotorstudy import Entry, Model, Parameter, Problem, Spectrum, Term, measured_response
from rotorstudy.cracks import crack_parameters
from rotorstudy.integration import force_in_time
from rotorstudy.plugins import Effect
from rotorstudy.response import forced_harmonics
from rotorstudy.spectrum import components, independent_covariance
from rotorstudy.terms import apply_entries

HARMONICS = np.array([0, 1, 2, 3, 5, 7, -1, -3, -5])
SPEEDS = np.array([90.0, 200.0, 310.0, 450.0])  # below the critical speeds of the rotors in test_plugins_all
ROUND_OFF = 1e-12  # relative: 1e-16 a product, some hundred products and sums
# a round trip without noise: weights floored at 1e-13 of the largest harmonic, the weakest effect moves 1e-6 of it
ROUND_TRIP = 1e-6


def agree(found, expected, tolerance, what):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape, f"{what}: shape {found.shape}, expected {expected.shape}"
    worst = np.abs(found - expected).max(initial=0)
    allowed = tolerance * np.abs(expected).max(initial=0)
    assert worst <= allowed, f"{what}: off by {worst:.3g}, allowed {allowed:.3g}"  # False for NaN


def check_stated(plugin):
    assert plugin.name and plugin.name.isidentifier(), f"name {plugin.name!r} cannot stand in a rig file"
    assert plugin.summary, f"{plugin.name}: its function has no docstring"
    assert plugin.source.strip(), f"{plugin.name}: no source"


def check_rotor(structure):
    count = len(structure.dofs)
    for name in ("mass", "stiffness", "gyroscopic"):
        matrix = getattr(structure, name)
        assert matrix.shape == (count, count) and np.isrealobj(matrix), f"{name} is not real (dof, dof)"
        agree(matrix, matrix.T, ROUND_OFF, f"{name} is not symmetric")
    assert (np.linalg.eigvalsh(structure.mass) > 0).all(), "mass is not positive"
    lowest = np.linalg.eigvalsh(structure.stiffness).min()
    assert lowest > -ROUND_OFF * np.abs(structure.stiffness).max(), "stiffness pushes away"
    assert structure.static_load.shape == (count,) and structure.stiffness_loss is not None
    for name, (pattern, unit, typical) in structure.stiffness_loss.items():
        agree(pattern, pattern.T, ROUND_OFF, f"{name}: pattern is not symmetric")
        assert (np.linalg.eigvalsh(pattern) >= 0).all(), f"{name}: a crack cannot stiffen"
        assert unit and 0 < typical < np.inf, f"{name}: unit or typical size not given"


def check_parameters(parameters, size):
    """Unit and typical size given, keys usable, tables of the right shape."""
    assert parameters, "no parameter"
    names = [parameter.name for parameter in parameters]
    assert len(set(names)) == len(names), f"names {names} are not distinct"
    for parameter in parameters:
        assert isinstance(parameter, Parameter) and parameter.entries, f"{parameter} has no table"
        assert parameter.unit and parameter.key.isprintable() and " " not in parameter.key, f"{parameter.name}: unit"
        assert 0 < parameter.typical < np.inf, f"{parameter.name}: typical size {parameter.typical}"
        for entry in parameter.entries:
            assert isinstance(entry, Entry) and entry.on in ("z", "conj", "one") and entry.order >= 0
            shape = (size,) if entry.on == "one" else (size, size)
            assert np.shape(entry.matrix) == shape, f"{parameter.name}: matrix {np.shape(entry.matrix)}, not {shape}"


def motion(speed, size, samples=256, highest=3):
    """A motion with harmonics -highest..highest and a static part, over one turn: harmonics, static part, in time."""
    random = np.random.default_rng(1)
    harmonics = np.arange(-30, 31)  # all that a shift by up to 27 can reach
    amplitude = random.standard_normal((len(harmonics), size, 2)) @ [1, 1j] * (abs(harmonics) <= highest)[:, None]
    static = random.standard_normal(size)
    time = np.arange(samples) / samples * 2 * np.pi / speed
    basis = np.exp(1j * np.outer(time, harmonics) * speed)
    derivative = 1j * harmonics[:, None] * speed
    in_time = [basis @ amplitude + static, basis @ (derivative * amplitude), basis @ (derivative**2 * amplitude)]
    return harmonics, amplitude, static, time, in_time


def projected(force, speed, time, harmonics):
    """(harmonic, row) harmonics of a force (time, row) over one turn."""
    return np.exp(-1j * np.outer(harmonics, time) * speed) @ force / len(time)


def columns(entries, speeds, size):
    """(speed, harmonic, row) harmonics of a table acting on `motion`, all speeds in one call."""
    every = [motion(speed, size) for speed in speeds]
    harmonics, static = every[0][0], every[0][2]
    return apply_entries(entries, np.array([m[1] for m in every]), speeds, harmonics, static)


def check_columns(parameters, size, speeds=SPEEDS):
    """The table acting on harmonics is its force in time, projected."""
    for unknown in Term("checked", tuple(parameters)).unknowns:
        if any(entry.frequency_only for entry in unknown.entries):
            continue  # no form in time
        found = columns(unknown.entries, speeds, size)
        for i, speed in enumerate(speeds):
            harmonics, _, _, time, in_time = motion(speed, size)
            force = force_in_time(unknown.entries, speed, time, *in_time)
            agree(found[i], projected(force, speed, time, harmonics), ROUND_OFF, f"{unknown.name} at {speed:g} rad/s")


def check_force(parameters, form, size, speeds=SPEEDS):
    """The table is an equation written down independently.

    form : function(parameter name, speed, time, z, velocity) -> (time, row) force of the unit amplitude
    """
    for parameter in parameters:
        found = columns(parameter.entries, speeds, size)
        for i, speed in enumerate(speeds):
            harmonics, _, _, time, (z, velocity, _) = motion(speed, size)
            force = form(parameter.name, speed, time, z, velocity)
            agree(found[i], projected(force, speed, time, harmonics), ROUND_OFF, f"{parameter.name} at {speed:g} rad/s")


def spectrum_of(model, harmonics, speeds=SPEEDS, variance=0.0):
    amplitude = measured_response(model, speeds, harmonics)
    covariance = independent_covariance(np.full(amplitude.shape, variance))
    return Spectrum(amplitude, speeds, np.asarray(harmonics), model.sensors, covariance)


def check_round_trip(plugin, structure, surroundings, estimator, **options):
    """Simulated with usual sizes, identified with the rest known: the sizes come back.

    surroundings : Terms with values, which excite and damp the rotor
    """
    acts_on = getattr(plugin, "acts_on", "rotor")
    if hasattr(plugin, "series"):
        parameters = crack_parameters(plugin, structure, **options)
    else:
        parameters = plugin.function(structure.nodes if acts_on == "output" else structure, **options)
    values = {p.name: p.typical * (0.7 * np.exp(0.5j) if p.is_complex else 0.7) for p in parameters}
    known = Term(plugin.name, tuple(parameters), values, acts_on, "checked")
    unknown = Term(plugin.name, tuple(parameters), {}, acts_on, "checked")
    true, sought = Model(structure, (*surroundings, known)), Model(structure, (*surroundings, unknown))
    spectrum = spectrum_of(true, np.union1d(HARMONICS, forced_harmonics(true)))
    names = sought.unknown_names()
    found = estimator.function(Problem(sought, spectrum, names))
    expected = true.theta[true.position(names)]
    scale = true.typical[true.position(names)]
    agree(found.theta / scale, expected / scale, ROUND_TRIP, f"{plugin.name} by {estimator.name}")


def required_options(function, given_by_engine):
    """1 for each option that has no default: every numeric option takes it."""
    parameters = inspect.signature(function).parameters.values()
    return {p.name: 1 for p in parameters if p.name not in given_by_engine and p.default is p.empty}


def check_effect(effect, structure):
    output = effect.acts_on == "output" if isinstance(effect, Effect) else False
    first = structure.nodes if output else structure
    given = required_options(effect.function, ("sensors" if output else "structure",))
    size = len(structure.nodes) if output else len(structure.dofs)
    parameters = effect.function(first, **given)
    check_parameters(parameters, size)
    check_columns(parameters, size)


def check_crack(crack, order=15, samples=2**18):
    """Opening periodic and within 0 (closed) and 1 (open); the series is that of the opening."""
    angle = (np.arange(samples) + 0.5) * 2 * np.pi / samples
    opening = np.asarray(crack.function(angle), float)
    assert opening.shape == angle.shape, "opening has another shape than the angle"
    assert np.isfinite(opening).all() and opening.min() >= -ROUND_OFF and opening.max() <= 1 + ROUND_OFF, (
        f"opening between {opening.min():g} and {opening.max():g}, not 0 and 1"
    )
    # a jump lies between two samples, so it is known to 1 / samples; up to eight jumps a turn
    jumps = 8 / samples
    for turns in (1, -1):
        apart = np.abs(crack.function(angle + 2 * np.pi * turns) - opening)
        assert np.mean(apart) <= jumps, f"opening differs by {np.mean(apart):g} after a turn"
    assert float(crack.function(angle[7])) == opening[7], "opening of one angle differs from that of many"
    series = crack.series(order)
    assert all(k == int(k) and abs(k) <= order for k in series), f"series has orders {sorted(series)} above {order}"
    for k in range(-order, order + 1):
        exact = np.mean(opening * np.exp(-1j * k * angle))
        found = series.get(k, 0)
        assert abs(found - exact) <= jumps, f"s_{k} = {found:.6g}, that of the opening is {exact:.6g}"
        assert abs(series.get(-k, 0) - np.conj(found)) < 1e-15, f"s_{-k} is not the conjugate of s_{k}"
    shorter = crack.series(3)
    assert all(abs(shorter.get(k, 0) - series.get(k, 0)) < 1e-15 for k in range(-3, 4)), "s_k depends on the order"


def _record(samples, speed, revolutions, trials=1):
    random = np.random.default_rng(2)
    every = np.arange(-8, 9)  # also harmonics that nobody asks for
    amplitude = random.standard_normal((trials, len(every), 2)) @ [1, 1j]
    time = 0.3 + np.arange(samples) * revolutions * 2 * np.pi / (speed * samples)  # phase counts from the first sample
    signal = amplitude @ np.exp(1j * np.outer(every, time - time[0]) * speed)
    return time, signal, amplitude[:, np.searchsorted(every, HARMONICS)]


def check_spectrum_exact(method, speed=90.0):
    """Exact on a record of whole turns, for complex and real signals, one or several."""
    time, signal, true = _record(512, speed, 8, trials=3)
    amplitude, covariance = method.function(signal, time, speed, HARMONICS)
    agree(amplitude, true, ROUND_OFF, method.name)
    assert covariance.shape == (3, 2 * len(HARMONICS), 2 * len(HARMONICS))
    agree(method.function(signal[0], time, speed, HARMONICS)[0], true[0], ROUND_OFF, f"{method.name}, one signal")
    cosine = 3e-6 * np.cos(2 * speed * (time - time[0]) + 0.4)
    expected = np.where(HARMONICS == 2, 1.5e-6 * np.exp(0.4j), 0)
    agree(method.function(cosine, time, speed, HARMONICS)[0], expected, ROUND_OFF, f"{method.name}, real signal")


def check_covariance(errors, stated, what, bias=0.0):
    """Errors (trial, component) scatter as the stated covariance (component, component) says.

    bias : relative error of the variance that the method may have
    """
    trials, size = errors.shape
    lower = np.linalg.cholesky(stated)
    whitened = np.linalg.solve(lower, errors.T)
    seen = whitened @ whitened.T / trials
    # of a sample variance sqrt(2 / trials), of its mean over components less; six deviations: one in 10^8 fails
    assert abs(np.trace(seen) / size - 1) < 6 * np.sqrt(2 / (trials * size)) + bias, (
        f"{what}: variance is {np.trace(seen) / size:.3g} of the stated one"
    )
    worst = np.abs(seen - np.eye(size)).max()
    assert worst < 6 * np.sqrt(2 / trials) + bias, f"{what}: covariance off by {worst:.3g} of the stated variance"


def check_spectrum_covariance(method, speed=90.0, trials=400):
    """The stated covariance is that of many short noisy records."""
    samples = 1024
    time, signal, true = _record(samples, speed, 4)
    random = np.random.default_rng(3)
    noise = random.standard_normal((trials, samples, 2)) @ [1, 1j]
    amplitude, covariance = method.function(signal + 0.1 * noise, time, speed, HARMONICS)
    errors = components((amplitude - true)[..., None])[..., 0]
    # the floor is a median: 17 lines among 1024 bins, taken out or left in, move it by 17 / 1024 / ln 2 = 2.4 %
    check_covariance(errors, covariance.mean(axis=0), method.name, bias=0.03)


def check_estimator(estimator, model, names):
    """Exact on data without noise, one spectrum or many; stated covariance positive."""
    spectrum = spectrum_of(model, HARMONICS)
    true = model.theta[model.position(names)]
    found = estimator.function(Problem(model, spectrum, names))
    agree(found.theta / true, np.ones(len(names)), ROUND_TRIP, estimator.name)
    assert found.covariance.shape == (len(names),) * 2
    agree(found.covariance, found.covariance.T, 1e-6, f"{estimator.name}: covariance is not symmetric")
    assert (np.diag(found.covariance) >= 0).all(), f"{estimator.name}: negative variance"
    twice = spectrum.with_amplitude(np.stack([spectrum.amplitude] * 2))
    agree(estimator.function(Problem(model, twice, names)).theta / true, np.ones((2, len(names))), ROUND_TRIP, "twice")


def check_estimator_covariance(estimator, model, names, trials=400):
    """The stated covariance is that of many noisy spectra; the noise is small, so that first order is enough."""
    spectrum = spectrum_of(model, HARMONICS)
    std = 1e-4 * np.abs(spectrum.amplitude[:, np.flatnonzero(HARMONICS == 1)]).min()
    spectrum = spectrum_of(model, HARMONICS, variance=std**2)
    noise = np.random.default_rng(4).standard_normal((trials, *spectrum.amplitude.shape, 2)) @ [1, 1j]
    found = estimator.function(Problem(model, spectrum.with_amplitude(spectrum.amplitude + std * noise), names))
    stated = np.broadcast_to(found.covariance, (trials, len(names), len(names))).mean(axis=0)
    # second order of noise that is 1e-4 of 1X
    check_covariance(found.theta - model.theta[model.position(names)], stated, estimator.name, bias=0.01)
