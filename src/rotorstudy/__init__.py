"""rotorstudy: rotor models as tables of effects, identification from full spectra, studies as a workflow.

    from rotorstudy import load_rig, harmonic_response, registry

The names below are imported when first used, so that `import rotorstudy` stays fast.
"""

__version__ = "0.2.0"

_HOME = {
    "Entry": "model.entries",
    "NonlinearForce": "model.terms",
    "Parameter": "model.terms",
    "Term": "model.terms",
    "Structure": "model.structure",
    "Model": "model.model",
    "load_rig": "model.rig",
    "read_rig": "model.rig",
    "build_model": "model.rig",
    "make_term": "model.rig_items",
    "registry": "model.registry",
    "hookimpl": "model.kinds",
    "harmonic_response": "response.harmonic",
    "measured_response": "response.measured",
    "harmonic_response_and_jacobian": "response.harmonic",
    "measured_response_and_jacobian": "response.measured",
    "time_response": "response.integration",
    "eigenvalues": "response.stability",
    "stability_threshold": "response.stability",
    "check_stable": "response.stability",
    "Record": "measurement.records",
    "full_spectrum": "measurement.full_spectra",
    "simulate_records": "measurement.records",
    "read_measurement": "measurement.measurement",
    "load_spectrum": "measurement.netcdf_files",
    "measured_spectrum": "measurement.measurement",
    "Spectrum": "measurement.spectrum",
    "Problem": "inference.problem",
    "Estimate": "inference.estimate",
    "cramer_rao_bound": "inference.output_error",
    "magnitude_and_phase": "inference.estimate",
    "plot_full_spectrum": "presentation.plots",
    "RotorstudyError": "errors",
}

__all__ = sorted(_HOME)


def lazily(module, home):
    """`__getattr__` and `__dir__` of a module whose names are imported when first used; home : name -> their module."""

    def found(name):
        if name not in home:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        from importlib import import_module

        return getattr(import_module(f"rotorstudy.{home[name]}"), name)

    return found, lambda: sorted(home)


__getattr__, __dir__ = lazily(__name__, _HOME)
