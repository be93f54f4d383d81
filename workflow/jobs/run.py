"""A job: a call of a function in a process of its own, with its log, and a digest of the code that it depends on."""

import functools
import multiprocessing
import sys
import threading
import traceback
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import wait
from pathlib import Path

from rotorstudy.threads import use_one_thread

use_one_thread()  # Snakemake states as many threads as a job has cores, which the processes of the job share

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.registry import blamed
from rotorstudy.store import load

PACKAGES = ("rotorstudy", "thesis", "jobs")  # whose files a job may depend on
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(["snakemake.cli", "jobs.preloaded"])  # copies import what started them
_LOCK = threading.Lock()


def run_job(job, inputs, outputs, wildcards, threads, log):
    """Run a Job, and the rest as Snakemake has it, in a copy of a process with the imports that most need."""
    numbers = {name: int(value) for name, value in wildcards.items()}
    given = {**job.given, **numbers, **({"cores": threads} if job.threads > 1 else {})}
    copy = _SERVER.Process(target=_work, args=(job, dict(inputs.items()), dict(outputs.items()), given, log[0]))
    with _LOCK:  # starting one looks at how others ended, which two threads must not do at once
        copy.start()
    wait([copy.sentinel])
    with _LOCK:
        copy.join()
    if copy.exitcode:
        raise RotorstudyError(f"{job.name} ended with {copy.exitcode}; see {log[0]}")


def _work(job, inputs, outputs, given, log):
    with logged(log):
        named_function(job.function)(**opened(inputs, job.load), **outputs, **given)


@contextmanager
def logged(path):
    """Redirect output to a file; a user's mistake ends the process with a one-line message."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    screen = sys.stderr
    with Path(path).open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
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


def opened(inputs, configuration=""):
    """Inputs by name, NetCDF files as Datasets; several of one name as {file name without its ending: Dataset}.

    configuration : full name of the function that reads the file `config`, if there is one
    """
    found = {}
    for name, given in inputs.items():
        paths = [Path(path) for path in ([given] if isinstance(given, str) else given)]
        found[name] = given
        if paths and all(path.suffix == ".nc" for path in paths):
            data = {path.stem: load(path) for path in paths}
            found[name] = data[paths[0].stem] if isinstance(given, str) else data
    return found | ({"config": named_function(configuration)(inputs["config"])} if configuration else {})


def named_function(name):
    """The function of a full name: "rotorstudy.studies.identify.bias"."""
    module, _, attribute = name.rpartition(".")
    inside = vars(import_module(module))
    if attribute not in inside:
        own = [name for name, one in inside.items() if getattr(one, "__module__", "") == module and name[0] != "_"]
        raise unknown_name("function", attribute, own, module)
    return inside[attribute]


@functools.cache
def _graph():
    """Which module of the packages imports which, also inside functions."""
    import grimp

    return grimp.build_graph(*PACKAGES, cache_dir=None)


@functools.cache
def _file(module):
    """The file of a module of the packages."""
    return Path(find_spec(module).origin)


def imported_files(*functions):
    """Files of the packages that functions, by full names, depend on: Snakemake does not look into what they import."""
    graph = _graph()
    named = {one.rpartition(".")[0] for one in functions}
    files = {_file(module) for module in named.union(*map(graph.find_upstream_modules, named))}
    templates = {page for file in files for page in file.parent.glob("templates/*.*")}
    return sorted(map(str, files | templates))


@functools.cache
def _file_digest(path):
    return sha256(Path(path).read_bytes()).digest()


def code_digest(*functions, files=()):
    """One text for all that `imported_files` lists, and further files; another one if any of them changes."""
    return sha256(b"".join(map(_file_digest, [*imported_files(*functions), *files]))).hexdigest()
