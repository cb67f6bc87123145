"""Resume an interrupted sweep: which jobs are finished, and which failed before."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mvreg.errors import InputError
from mvreg.report.json_file import dumps, load_report
from mvreg.report.run_folder import write_text

if TYPE_CHECKING:
    from omegaconf import DictConfig

#: In the folder of a job that failed: its message.
ERROR = "error.txt"
#: Keys of the configuration that change nothing about the result.
IRRELEVANT = frozenset(
    {"resume", "rerun", "debug", "export", "store", "store_size", "executor", "shard"}
)


def finished(folder: Path, config: DictConfig) -> dict[str, Any] | None:
    """The report in a run folder, if it answers what a configuration asks.

    Parameters
    ----------
    folder : Path
        The folder that the run would write to.
    config : DictConfig
        What the run is to do.

    Returns
    -------
    dict or None
        None where there is no report, or it is of another configuration, of a run that was
        interrupted, or of one that failed when it was last tried; and where a recording is wanted
        that is not there.
    """
    from omegaconf import OmegaConf

    if (folder / ERROR).exists() or (config.rerun and not (folder / "run.rrd").exists()):
        return None
    try:
        report = load_report(folder)
    except InputError:
        return None
    # Through JSON as the report went, lest a tuple differ from a list.
    plain = OmegaConf.to_container(config, resolve=True, enum_to_str=True)
    wanted = json.loads(dumps({"config": plain}))["config"]
    same = relevant(report.get("config") or {}) == relevant(wanted)
    return report if same and report.get("status") in ("complete", "incomplete") else None


def relevant(config: Mapping[str, object]) -> dict[str, object]:
    """What of a configuration decides the result."""
    return {key: value for key, value in config.items() if key not in IRRELEVANT}


def told(report: Mapping[str, Any], folder: Path) -> str:
    """One line about a run that is not run again."""
    from mvreg.report.provenance import commit

    here = Path.cwd()
    shown = folder.relative_to(here) if folder.is_relative_to(here) else folder
    placed = f"placed {len(report['poses'])} of {len(report['scans'])} scans"
    then, now = report.get("commit"), commit()
    other = f", at commit {then}, and now it is {now}" if then and then != now else ""
    return f"done already: {shown}: {placed}{other}"


@contextmanager
def message_kept(folder: Path, message: Callable[[Exception], str]) -> Iterator[None]:
    """Leave the message of what goes wrong inside in `folder`, and take an earlier one away.

    Parameters
    ----------
    folder : Path
        The run's folder.
    message : callable
        The text for an exception.
    """
    (folder / ERROR).unlink(missing_ok=True)
    try:
        yield
    except Exception as error:
        if folder.is_dir():
            write_text(folder / ERROR, f"{message(error)}\n")
        raise
