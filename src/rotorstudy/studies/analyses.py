"""Analyses of the rigs of a study: whirl, stability, weight dominance, identifiability, variants of the equations."""

from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.linear import check_identifiable, invert, solve_equations, solve_linear
from rotorstudy.measurement.spectrum import components
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import harmonic_response_and_jacobian
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import eigenvalues, stability_threshold
from rotorstudy.response.statics import static_deflection
from rotorstudy.response.whirl import critical_speeds, time_invariant, without_damping
from rotorstudy.studies.common import reported, results
from rotorstudy.studies.config import ExtraMeasurement

ORDERS = (1, 2, 3, -1)  # whose critical speeds are sought
AS_IT_IS = "as it is"
NOISE = 0.01  # white in time, relative to the rms vibration at the study's speeds; the same for all probes and speeds


def whirl(config, up_to=6.0):
    """A Dataset of the whirl of the uncracked rotor without damping, up to a multiple of its natural frequency."""
    models = {name: time_invariant(config.rig(name)) for name in config.rigs}
    thetas = {name: without_damping(model) for name, model in models.items()}
    natural = [np.abs(eigenvalues(model, [1e-3], thetas[name]).imag).min() for name, model in models.items()]
    highest = up_to * max(natural)
    speeds = np.linspace(highest / 300, highest, 300)
    frequency = np.array([eigenvalues(model, speeds, thetas[name]).imag for name, model in models.items()])
    is_mirrored = np.allclose(frequency, -frequency[..., ::-1], rtol=1e-6, atol=1e-6 * highest)
    if is_mirrored:  # on anisotropic bearings each mode appears at plus and minus its frequency
        frequency = frequency[..., frequency.shape[-1] // 2 :]
    found = [critical_speeds(model, highest, ORDERS, thetas[name]) for name, model in models.items()]
    most = max(len(values) for rig in found for values in rig)
    critical = np.array([[np.pad(v, (0, most - len(v)), constant_values=np.nan) for v in rig] for rig in found])
    coordinates = {"rig": list(models), "speed": speeds, "mode": np.arange(frequency.shape[-1]), "order": list(ORDERS)}
    variables = {"frequency": frequency, "critical_speed": critical, "natural_frequency": natural}
    return results("whirl", f"{config.title}: whirl", **coordinates, critical=np.arange(most), **variables)


def damping_along_x(unknown):
    """Largest force along x, N, of a unit amplitude at a velocity of 1 m/s along x; 0 without damping there."""
    rates = [entry.matrix for entry in unknown.entries if entry.reads_motion and entry.order == 1]
    return np.abs(np.real(sum(rates, np.zeros((1, 1))))).max()


def stability(config, ratios=(0.5, 1.0, 2.0, 5.0), up_to=8.0):
    """A Dataset of growth rate and threshold of the uncracked rig for ratios of external to internal damping."""
    model = time_invariant(config.rig(config.main_rig))
    internal = model.position(["internal_damping"])[0]
    external = sum(
        value * damping_along_x(unknown)
        for unknown, value in zip(model.rotor_unknowns, model.theta[: len(model.rotor_unknowns)], strict=True)
        if unknown.name != "internal_damping"
    )
    undamped = np.abs(eigenvalues(model, [1.0], without_damping(model)).imag).min()
    relative = np.linspace(0.05, up_to, 160)

    def at(ratio):
        theta = model.theta.copy()
        theta[internal] = external / ratio
        growth = eigenvalues(model, relative * undamped, theta).real.max(axis=-1)
        found = stability_threshold(model, up_to * undamped, theta)
        return {"growth_rate": growth, "threshold": np.nan if found is None else found}

    given = {"damping_ratio": np.array(ratios), "relative_speed": relative, "natural_frequency": undamped}
    return results("stability", f"{config.title}: stability", ("damping_ratio",), at, **given)


def first_crack(config, rig):
    """The Term of the first crack of a rig."""
    kind = config.rigs[rig]["cracks"][0]["kind"]
    return next(term for term in config.rig(rig).terms if term.kind == kind)


def weight_dominance(config):
    """A Dataset of errors by weight dominance on the main rig, for scaled losses of its crack on the full motion."""
    rig = config.main_rig
    scales, crack = np.array(config.crack_scales), config.rigs[rig]["cracks"][0]
    term = first_crack(config, rig)
    least_squares = registry().get("estimator", "least_squares").function

    def at(scale):
        loss = {loss.key: scale * term.values[loss.name] for loss in term.parameters}
        cracks = ([{**crack, **loss, "weight_dominance": dominance}] for dominance in (True, False))
        where = f"study {config.name}, weight dominance"
        dominant, full = (build_model({**config.rigs[rig], "cracks": one}, where=where) for one in cracks)
        both = (measured_response(m, config.shown_speeds_rad_s, config.harmonics) for m in (dominant, full))
        spectra = (config.clean_spectrum(full, case.speeds) for case in config.cases.values())
        problems = [config.problem(dominant, spectrum) for spectrum in spectra]
        estimates = np.array([reported(problem, least_squares(problem))[0] for problem in problems])
        error = config.relative_error(estimates, config.true_values(dominant))
        return {"displacement": [one[..., one.shape[-1] // 2] for one in both], "error": error}

    title = f"{config.title}: weight dominance against the full crack"
    given = config.coordinates | {"crack": ["weight dominant", "full"], "crack_scale": scales}
    return results("weight_dominance", title, ("crack_scale",), at, **given)


def variants(config):
    """A Dataset of the estimates of every variant and case, without noise, and their errors."""

    def solved(variant, case):
        variant, speeds = config.variants[variant], config.cases[case].speeds
        source, model, held = config.rig(variant.simulated), config.rig(variant.identified), variant.held_with_percent
        if held is not None:
            stiff = np.array([u.carries and u.unit == "N/m" for u in model.rotor_unknowns])
            theta = model.theta[: len(model.rotor_unknowns)] * np.where(stiff, 1 + held / 100, 1.0)
            model = replace(model, held_deflection=static_deflection(model, speeds, theta).value)
        problem = config.problem(model, config.clean_spectrum(source, speeds))
        problem = replace(problem, condensation=variant.condensation)
        exact = variant.condensation == "exact"
        theta = solve_equations(problem) if exact else solve_linear(*problem.equations(), problem.names)
        estimate = magnitude_and_phase(config.unknowns, theta, np.eye(len(theta)))[1]
        return {"estimate": estimate, "relative_error": config.relative_error(estimate, config.true_values(source))}

    given = config.coordinates | {"variant": list(config.variants)}
    given["true"] = config.true_values(config.rig(config.main_rig))
    return results("variants", f"{config.title}: variants of least squares", ("variant", "case"), solved, **given)


def information(config, model, speeds, harmonics, rows, std):
    """Fisher information J^T C^-1 J (parameter, parameter) of rows (output, dof) with noise std (output,), m."""
    if any(name in {u.name for u in model.output_unknowns} for name in config.unknowns):
        raise RotorstudyError("identifiability is computed for amplitudes of the rotor, not of its sensors")
    _, change = harmonic_response_and_jacobian(model, speeds, harmonics)
    weighted = np.einsum("od,shdp->shop", rows / std[:, None], change)[..., model.position(config.unknowns)]
    columns = np.stack([components(weighted[..., p]).ravel() for p in range(weighted.shape[-1])], axis=-1)
    check_identifiable(columns, config.unknowns)
    return columns.T @ columns


def identifiability(config):
    """A Dataset of bounds of the main rig with white noise on all probes, of correlations and further measurements."""
    model, options = config.rig(config.main_rig), {AS_IT_IS: ExtraMeasurement(), **config.extra_measurements}
    theta, units = model.theta[model.position(config.unknowns)], config.reported
    scale = np.where([unit == "rad" for unit in units.values()], 1, np.abs(config.true_values(model)))

    def at(case):
        own, covariances = config.cases[case].speeds, []
        shown = measured_response(model, own, config.harmonics)[:, np.array(config.harmonics) != 0]
        noise = NOISE * np.sqrt(np.mean(np.sum(np.abs(shown) ** 2, axis=1)) / 2)
        for extra in options.values():
            speeds = own if extra.speeds is None else extra.speeds.speeds
            harmonics = config.harmonics if extra.harmonics is None else extra.harmonics
            rows, relative = extra.output_rows(model.structure, model.sensors)
            std = noise * relative / np.sqrt(config.record.samples * extra.times_longer)
            covariance = invert(information(config, model, speeds, harmonics, rows, std))
            covariances.append(magnitude_and_phase(config.unknowns, theta, covariance)[2])
        std = np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))
        correlation = covariances[0] / np.outer(std[0], std[0])  # as it is
        inflation = np.sqrt(np.diag(np.linalg.inv(correlation)))
        return {"noise": noise, "bound": std / scale, "correlation": correlation, "inflation": inflation}

    given = config.coordinates | {"measurement": list(options), "other_parameter": list(units)}
    return results("identifiability", f"{config.title}: identifiability, rig {config.main_rig}", ("case",), at, **given)
