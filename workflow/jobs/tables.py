"""Jobs that write the tables of a chapter."""

from jobs.run import named_function
from rotorstudy.presentation.tables import write_csv, write_tables


def write(scored, sheets, function, load, config, index, **results):
    """Write what a function makes of a configuration and results: rows of the scoreboard, and tables by name."""
    rows, tables = named_function(function)(named_function(load)(config), **results)
    write_csv(rows, scored)
    write_tables(tables, sheets, index)
