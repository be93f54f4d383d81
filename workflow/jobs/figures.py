"""Jobs that draw figures."""

from jobs.run import named_function
from rotorstudy.presentation.plots import save_figures


def draw(pictures, function, load, config, **results):
    """Write the figures that a function makes of results and of the file `config`, read by the function `load`."""
    save_figures(named_function(function)(named_function(load)(config), **results), pictures)
