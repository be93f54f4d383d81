"""Support of the workflow: configuration, logs of jobs, their inputs, the function to call, and the code it needs."""

import functools
import multiprocessing
import re
import runpy
import sys
import threading
import traceback
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import wait
from pathlib import Path

from rotorstudy.studies.threads import use_one_thread

use_one_thread()  # Snakemake states as many threads as a job has cores, which the processes of the job share

from pydantic import Field

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.configuration import Strict
from rotorstudy.model.registry import blamed
from rotorstudy.model.rig import named_plugins
from rotorstudy.store import load

PACKAGES = ("rotorstudy", "thesis")  # whose files a job may depend on
NAMED = re.compile(rf"\b(?:{'|'.join(PACKAGES)})(?:\.\w+)*")  # modules in the text of a script


class DiagnosisItem(Strict):
    """records : paths of record files or tables;  rig : rig file;  replay : the replay of the same data, if any"""

    records: list[str] = Field(min_length=1)
    rig: str
    replay: str = ""


class Chunks(Strict):
    """Number of jobs into which a sweep is split, for a cluster; the numbers do not depend on it.

    blind : by cases;  monte_carlo : by noise levels, of each rig of a study;  compare : by faults, of each method
    """

    blind: int = Field(default=1, ge=1)
    monte_carlo: int = Field(default=1, ge=1)
    compare: int = Field(default=1, ge=1)


class WorkflowConfig(Strict):
    """results, reference : folders;  studies, replays : name -> configuration file;  plugin_folders : further plugins

    blind, compare, cracks : configuration files of the blind tests, of the comparison of spectrum methods and
                             estimators, and of that of crack models; each is left out if not given
    diagnoses : name -> measured records and their rig file
    crack_study : configuration file of the study of transverse cracks, left out if not given
    chunks : numbers of jobs into which long sweeps are split
    independent_records : cases of the independent simulator (CSV), shown beside the blind tests
    published : folder of rig files, each beside a table of what others printed of that machine; left out if not given
    """

    results: str
    reference: str
    plugin_folders: list[str] = []
    studies: dict[str, str] = {}
    replays: dict[str, str] = {}
    blind: str | None = None
    compare: str | None = None
    diagnoses: dict[str, DiagnosisItem] = {}
    cracks: str = ""
    crack_study: str = ""
    chunks: Chunks = Chunks()
    independent_records: str = ""
    published: str = ""


def index_page(snakemake):
    """Path of the page of all results, which every other page links to."""
    return Path(snakemake.config["results"], "index.html")


_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(["snakemake.cli", "rotorstudy.studies.preloaded"])  # copies import what started them
_LOCK = threading.Lock()


def run_script(path, snakemake):
    """Run the script of a job in a copy of a process with the imports that most need: a start of Python takes a second.

    snakemake : what the script reads under this name: input, output, params, wildcards, threads, log, config
    """
    copy = _SERVER.Process(target=runpy.run_path, args=(str(path), {"snakemake": snakemake}, "__main__"))
    with _LOCK:  # starting one looks at how others ended, which two threads must not do at once
        copy.start()
    wait([copy.sentinel])
    with _LOCK:
        copy.join()
    if copy.exitcode:
        raise RotorstudyError(f"{Path(path).name} ended with {copy.exitcode}; see {snakemake.log[0]}")


@contextmanager
def job(snakemake):
    """Redirect the output of a script to the rule's log; a user's mistake ends the job with a one-line message."""
    path = Path(snakemake.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    screen = sys.stderr
    with path.open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
        try:
            yield
        except BaseException as error:  # a plugin may raise any, or call sys.exit
            message = error if isinstance(error, RotorstudyError) else blamed(error)
            if not message:
                raise
            if not isinstance(error, RotorstudyError):
                traceback.print_exc(file=log)
            print(f"error: {message}", file=log)
            print(f"error: {message}", file=screen)
            sys.exit(1)


def opened(inputs):
    """The Datasets among the inputs of a rule by name; of several files by the name of each without its ending."""
    found = {}
    for name, given in inputs.items():
        paths = [Path(path) for path in ([given] if isinstance(given, str) else given)]
        if paths and all(path.suffix == ".nc" for path in paths):
            data = {path.stem: load(path) for path in paths}
            found[name] = data[paths[0].stem] if isinstance(given, str) else data
    return found


def named_function(name):
    """The function of a full name: "rotorstudy.studies.whirl.whirl"."""
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(module), attribute)


def called(snakemake, config, **given):
    """Result of the function of a job (`params.function`) for a configuration."""
    params = {name: value for name, value in snakemake.params.items() if name not in ("function", "load", "code")}
    function = named_function(snakemake.params.function)
    return function(config, **params, **opened(snakemake.input), **given)


@functools.cache
def _graph():
    """Which module of the packages imports which, also inside functions."""
    import grimp

    return grimp.build_graph(*PACKAGES, cache_dir=None)


@functools.cache
def _file(module):
    """The file of a module of the packages."""
    name, *inside = module.split(".")
    base = Path(find_spec(name).origin).parent.joinpath(*inside)
    return base / "__init__.py" if base.is_dir() else base.with_suffix(".py")


def imported_files(script, *functions):
    """Files of the packages a job depends on: Snakemake notices changes of scripts but not of the modules they import.

    Those that the script and the functions name, all that these import (also inside functions), and page templates.
    """
    graph = _graph()
    named = {*NAMED.findall(Path(script).read_text(encoding="utf-8")), *(one.rpartition(".")[0] for one in functions)}
    seen = named & graph.modules
    seen = seen.union(*map(graph.find_upstream_modules, seen))
    files = {_file(module) for module in seen}
    templates = {page for file in files for page in file.parent.glob("templates/*.html")}
    return sorted(map(str, files | templates))


@functools.cache
def _file_digest(path):
    return sha256(Path(path).read_bytes()).digest()


def code_digest(script, *functions, files=()):
    """One text for a script, all that `imported_files` lists, and further files; another if any of them changes."""
    return sha256(b"".join(map(_file_digest, [script, *imported_files(script, *functions), *files]))).hexdigest()


def plugin_files(rigs, plugins=()):
    """Files of the plugins that rigs name, and of further plugins."""
    return sorted({plugin.file for plugin in [*plugins, *(p for rig in rigs for p in named_plugins(rig))]})
