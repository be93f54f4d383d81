"""What every workflow script is wrapped in: its log file, errors in one line, and what its result depends on."""

import ast
import functools
import sys
import traceback
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.registry import blamed


@contextmanager
def job(snakemake):
    """Send what a script prints to the rule's log; a mistake of the user ends the job with one line."""
    path = Path(snakemake.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    screen = sys.stderr
    with path.open("w") as log, redirect_stdout(log), redirect_stderr(log):
        try:
            yield
        except Exception as error:
            message = error if isinstance(error, RotorstudyError) else blamed(error)
            if not message:
                raise
            if not isinstance(error, RotorstudyError):
                traceback.print_exc(file=log)
            print(f"error: {message}", file=log)
            print(f"error: {message}", file=screen)
            sys.exit(1)


@functools.cache
def _imports(file):
    """Files of this package that one file imports, also inside functions. Kept: every script shares most of them."""
    home = Path(__file__).parents[1]
    modules = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            modules += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
    bases = [
        home.joinpath(*parts[1:]) for parts in (module.split(".") for module in modules) if parts[0] == "rotorstudy"
    ]
    return {path for base in bases for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()}


def imported_files(script):
    """Files of this package a script imports, directly or through others (also inside functions); itself not included.

    Snakemake sees a change of a script but not of the modules behind it; a rule that lists these as input does.
    """
    seen, waiting = set(), [Path(script)]
    while waiting:
        new = _imports(waiting.pop()) - seen
        seen |= new
        waiting += new
    return sorted(map(str, seen))


def plugin_files(rigs, plugins=()):
    """Files of the plugins that rigs name, and of further ones."""
    from rotorstudy.model.rig import named_plugins

    return sorted({plugin.file for plugin in [*plugins, *(p for rig in rigs for p in named_plugins(rig))]})
