"""Jobs that draw figures and write tables of a chapter."""

from jobs.run import named_function
from rotorstudy.presentation.pages import write_csv, write_tables
from rotorstudy.presentation.plots import save_figures


def draw(pictures, function, load, config, **results):
    """Write the figures that a function makes of results and of the file `config`, read by the function `load`."""
    save_figures(named_function(function)(named_function(load)(config), **results), pictures)


def write(scored, sheets, function, load, config, index, **results):
    """Write what a function makes of a configuration and results: rows of the scoreboard, and tables by name."""
    rows, tables = named_function(function)(named_function(load)(config), **results)
    write_csv(rows, scored)
    write_tables(tables, sheets, index)
