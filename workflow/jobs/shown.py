"""Jobs that draw figures and write tables of a chapter."""

import inspect
from pathlib import Path

from jobs.run import named_function
from rotorstudy.presentation.pages import address, to_index, write_csv, write_html
from rotorstudy.presentation.plots import save_figures
from rotorstudy.store import files_by_name


def draw(pictures, calls, **inputs):
    """Write figures; calls : name of each -> full name of a function, and its arguments.

    A function takes what it names of these, and of the inputs, which are a configuration and results.
    """
    made = {}
    for name, (function, arguments) in calls.items():
        function, known = named_function(function), inputs | arguments
        made[name] = function(**{key: known[key] for key in inspect.signature(function).parameters if key in known})
    save_figures(made, pictures)


def write(files, function, index, **inputs):
    """Write the tables, by name, that a function makes of its inputs."""
    write_tables(named_function(function)(**inputs), files, index)


def write_tables(tables, paths, index=None):
    """Write every table to the files of its name: .csv for programs, .html for people."""
    for name, files in files_by_name("table", tables, paths).items():
        for path in files:
            if path.suffix == ".csv":
                write_csv(tables[name].rows, path)
            else:
                write_html(path, tables[name], _links(path, tables[name].rows, index))


def _links(path, rows, index):
    """To the page of all results and, from printed values beside ours, to the reasons why they differ."""
    links = to_index(path, index)
    if links and any(name.endswith(": status") for name in map(str, rows.columns)):
        links["Reasons for what differs"] = address(path, Path(index).with_name("scoreboard.html"))
    return links
