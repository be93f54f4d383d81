"""Jobs that compute results: a NetCDF file for each function that they call."""

from jobs.run import named_function
from rotorstudy.model.registry import registry
from rotorstudy.store import provenance, save


def compute(data, calls, plugins, config, **results):
    """Write what each of `calls` (full name, arguments) gives for a configuration to `data`."""
    origin = provenance(config.model_dump(), [plugin for _, plugin in registry() if plugin.file in plugins])
    for path, (function, given) in zip(data, calls, strict=True):
        save(named_function(function)(config, **given, **results).assign_attrs(origin), path)
