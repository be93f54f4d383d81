"""rotorstudy: rotor models as tables of effects, identification from full spectra, studies as a workflow.

    from rotorstudy import load_rig, harmonic_response, registry

The names below are imported when first used, so that `import rotorstudy` stays fast.
"""

__version__ = "0.1.0"

_HOME = {
    "Entry": "terms",
    "LocalForce": "terms",
    "Parameter": "terms",
    "Term": "terms",
    "Structure": "model",
    "Model": "model",
    "load_rig": "rig",
    "build_model": "rig",
    "make_term": "rig",
    "registry": "plugins",
    "hookimpl": "plugins",
    "harmonic_response": "response",
    "measured_response": "response",
    "time_response": "integration",
    "eigenvalues": "stability",
    "stability_threshold": "stability",
    "Record": "records",
    "full_spectrum": "records",
    "simulate_records": "records",
    "load_records": "record_files",
    "read_measurement": "measured",
    "load_spectrum": "measured",
    "Spectrum": "spectrum",
    "Problem": "identification",
    "Estimate": "identification",
    "cramer_rao_bound": "identification",
    "magnitude_and_phase": "identification",
    "plot_full_spectrum": "plots",
    "RotorstudyError": "errors",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module 'rotorstudy' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"rotorstudy.{_HOME[name]}"), name)


def __dir__():
    return [*__all__, "__version__"]
