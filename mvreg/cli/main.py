"""The command line: a Hydra run, and subcommands.

Exit codes: 0 every scan placed in one model, 3 some not, 2 wrong input, 1 a bug, 130 Ctrl-C. A
sweep ends with the worst of its runs' codes.
"""

from __future__ import annotations

import logging
import os
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from mvreg.cli.codes import add_code, collected_codes, variable
from mvreg.cli.interrupts import INTERRUPTED, interrupted
from mvreg.errors import MvregError, StageError

if TYPE_CHECKING:
    from omegaconf import DictConfig

DONE, NOT_PLACED, WRONG_INPUT, BUG = 0, 3, 2, 1
SEVERITY = (DONE, NOT_PLACED, WRONG_INPUT, BUG, INTERRUPTED)  # from good to bad
#: The subcommands: functions of their name, in these modules; "_" for "-".
COMMANDS = {
    "plugins": "mvreg.cli.listing",
    "inspect": "mvreg.cli.listing",
    "report": "mvreg.cli.report_again",
    "compare": "mvreg.cli.compare_runs",
    "view": "mvreg.cli.view_run",
    "look": "mvreg.cli.look",
    "export": "mvreg.cli.export",
    "store": "mvreg.cli.kept",
    "add": "mvreg.cli.add",
    "new-plugin": "mvreg.cli.new",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the program's name; from `sys.argv` if not given.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = any(word.lstrip("+").lower() == "debug=true" for word in words)
    with warnings.catch_warnings():
        warnings.showwarning = show_warning
        try:
            return guarded(lambda: dispatch(words), debug)
        except KeyboardInterrupt:
            say("interrupted")
            return INTERRUPTED


def dispatch(words: list[str]) -> int:
    """Do what the first word says."""
    from mvreg.cli import listing

    first = words[0] if words else ""
    if first not in COMMANDS and {"-h", "--help"} & set(words):
        return listing.usage()
    if "--version" in words:
        return listing.version()
    if first in COMMANDS:
        name = first.replace("-", "_")
        command: Callable[[list[str]], int] = getattr(import_module(COMMANDS[first]), name)
        return command(words[1:])
    return run_hydra(words)


def guarded(action: Callable[[], int], debug: bool) -> int:
    """Call `action`; what it raises becomes one message and an exit code."""
    try:
        return action()
    except SystemExit as stop:  # argparse, for --help and for wrong options
        return stop.code if isinstance(stop.code, int) else DONE if stop.code is None else BUG
    except BrokenPipeError:  # as in `mvreg plugins | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        if interrupted():  # it has come out as another error
            raise KeyboardInterrupt from None
        if debug:
            traceback.print_exc()
        known = wrong_input(error) is not None and not isinstance(error, StageError)
        advice = "" if debug or known else "; run again with debug=true to see the traceback"
        say(f"error: {message(error)}{advice}")
        return WRONG_INPUT if known else BUG


def message(error: Exception) -> str:
    """What is said of an error, in one line for most."""
    bug = f"this is a bug in mvreg or a plugin: {type(error).__name__}: {error}"
    return wrong_input(error) or bug


def wrong_input(error: Exception) -> str | None:
    """The message for an error that a person can act on, None for a bug."""
    if isinstance(error, MvregError):
        return str(error)
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    from mvreg.config.messages import explain

    if isinstance(error, HydraException | OmegaConfBaseException):
        return explain(error)
    if isinstance(error, OSError):  # a folder that cannot be written, a full disk
        return re.sub(r"^\[Errno \d+\] ", "", str(error)) or type(error).__name__
    return None


def run_hydra(words: list[str]) -> int:
    """Let Hydra compose, and run one job or a sweep."""
    import hydra

    from mvreg.cli.spelling import quoted_paths
    from mvreg.config.compose import VERSION_BASE
    from mvreg.config.messages import explained
    from mvreg.config.presets import CONFIG_PATH
    from mvreg.config.store import registered

    # It says at its import how many threads it takes, on standard output; pandas imports it.
    logging.getLogger("numexpr").setLevel(logging.WARNING)
    start: Callable[[], Any] = hydra.main(CONFIG_PATH, "config", VERSION_BASE)(job)
    readable = quoted_paths(words)
    with collected_codes() as codes, arguments_for_hydra(readable), registered(), explained():
        start()
    return max(codes, key=SEVERITY.index, default=DONE)


@contextmanager
def arguments_for_hydra(words: list[str]) -> Iterator[None]:
    """Hydra reads `sys.argv`; and prints errors and exits unless asked for the full error."""
    before = sys.argv
    sys.argv = [before[0], *words]
    try:
        with variable("HYDRA_FULL_ERROR", "1"):
            yield
    finally:
        sys.argv = before


def job(config: DictConfig) -> int:
    """One run of a sweep, or the only one; its failure does not end the others."""
    code = guarded(lambda: run(config), debug=bool(config.get("debug")))
    add_code(code)
    if interrupted():  # somebody passed it over: no further job
        raise KeyboardInterrupt
    return code


def run(config: DictConfig) -> int:
    """Register the scans that the configuration names, unless that is done already."""
    from hydra.core.hydra_config import HydraConfig

    from mvreg.cli.job import run_job
    from mvreg.cli.resume import finished, message_kept, told
    from mvreg.config.compose import check

    folder = Path(HydraConfig.get().runtime.output_dir)
    if config.resume and (done := finished(folder, config)):
        say(told(done, folder))
        export_again(folder, config)
        return NOT_PLACED if done["unregistered"] or done.get("components") else DONE
    with message_kept(folder, message):
        check(config)
        result = run_job(config, folder)
    return NOT_PLACED if result.unregistered or result.components else DONE


def export_again(folder: Path, config: DictConfig) -> None:
    """What `export` asks of a run that is finished already."""
    if config.export:
        from mvreg.cli.export import export

        export([str(folder), *map(str, config.export)])


def say(line: str) -> None:
    """A line on standard error."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning as one line, without the line of code that it came from."""
    say(f"warning: {message}")
