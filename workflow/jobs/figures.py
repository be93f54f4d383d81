"""Jobs that draw figures."""

from jobs.run import named_function
from rotorstudy.presentation.plots import save_figures


def draw(pictures, function, load, config, **results):
    """Write the figures that a function makes of a configuration and results to the files of their names.

    pictures : paths;  function, load : full names, of that function and of the one that reads the file `config`
    """
    save_figures(named_function(function)(named_function(load)(config), **results), pictures)
