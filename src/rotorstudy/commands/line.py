"""Analyse, simulate, identify and diagnose rotor rigs described by a rig file (YAML); list and write plugins."""

import argparse
import contextlib
import io
import json
import logging
import os
import signal
import sys
import threading
import time

from rotorstudy import __version__
from rotorstudy.commands import (
    analyse,
    balance,
    blind,
    check,
    compare,
    demo,
    diagnose,
    identify,
    new,
    plugins,
    simulate,
)
from rotorstudy.commands import import_records as import_
from rotorstudy.commands.shared import YAML, tell
from rotorstudy.errors import RigError, RotorstudyError
from rotorstudy.model.registry import blamed, registry
from rotorstudy.model.shown_units import QUANTITY, asked, shown_for

COMMANDS = (demo, analyse, simulate, import_, identify, diagnose, compare, balance, plugins, new, check, blind)
LONG = (compare, diagnose)  # commands that tell their progress also to a file
QUIET_S = 5.0  # seconds after which a detail is shown
EPILOG = """examples:
  rotorstudy demo
  rotorstudy new rig my_machine --records run_1.csv
  rotorstudy check my_machine.yaml
  rotorstudy analyse rig.yaml --out analysis
  rotorstudy import run_1.csv run_2.csv --rig rig.yaml --out spectrum.nc
  rotorstudy identify spectrum.nc --rig rig.yaml --unknowns internal_damping external_damping
  rotorstudy diagnose run_1.csv run_2.csv --rig rig.yaml --out diagnosis
  rotorstudy compare --before march.csv --after may.csv --rig rig.yaml --out what_changed
  rotorstudy balance run_1.csv run_2.csv --rig updated.yaml --planes 3 7
"""


class _Once(argparse._StoreAction):
    """An option that is an error if it is given twice: the first values would be lost."""

    def __call__(self, parser, namespace, values, option_string=None):
        given = namespace.__dict__.setdefault("given_once", set())
        if option_string and self.dest in given:
            parser.error(f"{option_string} is given twice; give it once, with all its values")
        given.add(self.dest)
        super().__call__(parser, namespace, values, option_string)


class _Parser(argparse.ArgumentParser):
    def __init__(self, *given, **options):
        super().__init__(*given, **options)
        self.register("action", None, _Once)
        self.register("action", "store", _Once)


def parser():
    """The argparse parser; `command` is a module, whose `run` returns what was found, or (exit status, that)."""
    raw = argparse.RawDescriptionHelpFormatter
    top = _Parser("rotorstudy", description=__doc__, epilog=EPILOG, formatter_class=raw)
    top.add_argument("--quiet", action="store_true", help="do not show progress")
    top.add_argument("--version", action="version", version=f"rotorstudy {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    units = f"units of texts and figures: {', '.join(QUANTITY)}"
    for command in COMMANDS:
        name, told = command.__name__.split(".")[-1].removesuffix("_records"), command.__doc__.rstrip(".")
        one = commands.add_parser(name, help=told[0].lower() + told[1:])
        one.set_defaults(command=command)
        command.add(one)
        one.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS, help="do not show progress")
        one.add_argument("--json", action="store_true", help="print what was found as JSON, all else to stderr")
        one.add_argument("--units", nargs="+", default=(), metavar="UNIT", help=units)
    return top


def _units_of_rig(given):
    """A block in which everything is said in the units of the rig file that a command reads, if it reads one."""
    from rotorstudy.yaml_file import read_yaml

    path, rig = _rig_of(given), {}
    if str(path).endswith(YAML) and os.path.isfile(path):
        with contextlib.suppress(RotorstudyError, OSError):  # said by the command that reads the file
            rig = read_yaml(path)
    return shown_for(rig, path)


def _rig_of(given):
    return getattr(given, "rig", None) or getattr(given, "file", "")


def run(given):
    """Run the command of parsed arguments: (exit status, what was found, for JSON)."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(asked(given.units))
        stack.enter_context(_units_of_rig(given))
        if given.json:
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        if given.command is not plugins:  # it lists them itself
            tell(f"warning: {failure}" for failure in registry().failures)
        found = given.command.run(given)
    status, data = found if isinstance(found, tuple) else (0, found)
    if given.json:
        print(json.dumps(data, indent=1, default=str))
    sys.stdout.flush()
    return status


def complete(commands):
    """Answer the shell that asks how a command line may go on, if the package argcomplete is installed."""
    if "_ARGCOMPLETE" in os.environ:
        with contextlib.suppress(ImportError):
            import argcomplete

            argcomplete.autocomplete(commands)


def show_progress(stream):
    """Write to a stream what the package is doing, with the seconds since the start; details after a while."""
    handler, start = logging.StreamHandler(stream), time.time()
    latest = start

    def is_shown(record):
        nonlocal latest
        record.seconds = record.created - start
        if record.levelno < logging.INFO and record.created < latest + QUIET_S:
            return False
        latest = record.created
        return True

    handler.setFormatter(logging.Formatter("%(seconds)5.1f s  %(message)s"))
    handler.addFilter(is_shown)
    logger = logging.getLogger("rotorstudy")
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)
    return handler


class Terminated(KeyboardInterrupt):
    """The signal that `kill` and schedulers of clusters send: unlike after Ctrl-C, nothing more is computed."""


_signals = []  # that were received; a library may answer with an exception of its own


def _stop(number, frame):
    _signals.append(number)
    raise KeyboardInterrupt if number == signal.SIGINT else Terminated


def main(arguments=None):
    """The exit status: 0, 1 after an error or a failed check, 2 for a wrong command line, 130 or 143 if stopped."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started the command
            setattr(sys, name, io.StringIO())
        stream = getattr(sys, name)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal that has no sign for ± shows a question mark
    commands = parser()
    complete(commands)
    given = commands.parse_args(arguments)
    told = sys.stderr.isatty() or given.command in LONG
    handler = show_progress(sys.stderr) if told and not given.quiet else None
    _signals.clear()
    for number, usual in ((signal.SIGTERM, signal.SIG_DFL), (signal.SIGINT, signal.default_int_handler)):
        if signal.getsignal(number) is usual and threading.current_thread() is threading.main_thread():
            signal.signal(number, _stop)  # so that partial files are removed
    try:
        return run(given)
    except RigError as error:
        rig = _rig_of(given)
        message = error if rig in str(error) else f"{rig}: {error}"
    except RotorstudyError as error:
        message = error
    except BrokenPipeError:  # the reader of the output has closed it, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except UnicodeError as error:
        message = blamed(error) or f"a name that this locale cannot write ({error}); set PYTHONUTF8=1"
    except (OSError, MemoryError) as error:
        place = getattr(error, "filename", None)
        message = blamed(error) or (f"{place}: {error.strerror}" if place else f"{type(error).__name__}: {error}")
    except BaseException as error:  # a plugin may raise any
        if _signals or isinstance(error, KeyboardInterrupt):
            print("stopped; files that were finished are kept", file=sys.stderr)
            return 128 + (_signals or [signal.SIGINT])[0]
        message = blamed(error)
        if not message:
            raise
    finally:
        logging.getLogger("rotorstudy").removeHandler(handler)
    print(f"error: {message}", file=sys.stderr)
    if given.json:
        with contextlib.suppress(OSError):  # of a full disk, which may be what is told
            print(json.dumps({"error": str(message)}), flush=True)
    return 1
