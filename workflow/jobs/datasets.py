"""Jobs that compute results: a NetCDF file for each function that they call."""

from jobs.run import named_function
from rotorstudy.model.registry import registry
from rotorstudy.store import provenance, save


def compute(data, calls, plugins, load, config, **results):
    """Write what some functions return for a configuration, each to its file, with its origin.

    data : paths;  calls : (full name of a function, its arguments) of each;  plugins : files of those that are used
    load : full name of the function that reads the file `config`;  results : of other jobs, for all functions
    """
    config = named_function(load)(config)
    origin = provenance(config.model_dump(), [plugin for _, plugin in registry() if plugin.file in plugins])
    for path, (function, given) in zip(data, calls, strict=True):
        save(named_function(function)(config, **given, **results).assign_attrs(origin), path)
