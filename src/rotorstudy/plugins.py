"""All that a plugin file imports, from one place that stays when the modules behind it change.

    from rotorstudy.plugins import Effect, Entry, Parameter

The names below are imported when first used, so that a plugin costs no more than what it needs.
"""

from rotorstudy import lazily

_HOME = {
    "model.kinds": "Bearing Crack CrackDepth Effect Estimator Feared Rotor SpectrumMethod hookimpl",
    "model.rig_numbers": "changeable_numbers number_slope",
    "model.bearings": "weight_carried",
    "model.entries": "Entry film_entries outer planar_entries",
    "model.terms": "NonlinearForce Parameter mean_overlap",
    "model.shaft": "RigidDisc Section",
    "model.structure": "Structure across at_supports couples_a_driver probe_axis sensor_unit spacers",
    "model.hinge": "crack_at",
    "model.options": "AtLeastOne DepthRatio Even Fraction NonNegative PoissonsRatio Positive Share TypedDict Whole",
    "model.cracks": "crack_parameters",
    "model.registry": "registry",
    "response.series": "rotating_basis",
    "measurement.harmonics": "circular_covariance fit_basis noise_power shared_error_covariance spectral_lines "
    "white_noise_covariance",
    "measurement.keyphasor": "shaft_angle",
    "measurement.receptances": "receptances_in",
    "inference.estimate": "Estimate linear_estimate",
    "inference.linear": "by_speed in_chunks invert noise_in_equations solve_equations solve_full_rank solve_linear "
    "solve_truncated solve_weighted undetermined whitened",
    "inference.prediction": "predicted_derivatives",
    "inference.output_error": "output_error_fit start_values",
    "errors": "CannotAct NoConvergenceError RotorstudyError UnidentifiableError check_known unknown_name",
}
_MODULE = {name: module for module, names in _HOME.items() for name in names.split()}

__all__ = sorted(_MODULE)
__getattr__, __dir__ = lazily(__name__, _MODULE)
