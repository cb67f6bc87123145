"""Answers without a run: `plugins`, `inspect`, ``--help``, ``--version``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from enum import Enum
from pathlib import Path

from mvreg.errors import InputError

#: Lines of the help are no longer than this.
WIDTH = 100

USAGE = """\
mvreg finds the poses of unordered range scans, with no initial guess.

Usage:
  mvreg [+method=NAME] [dataset=NAME] [KEY=VALUE ...]
  mvreg look FOLDER        what a folder of scans holds, and what looks wrong with it
  mvreg plugins [KIND]     every stage: what it does, its parameters, who registered it
  mvreg plugins check [NAME]   whether plugins do what their contracts ask; --all: mvreg's own too
  mvreg new-plugin NAME KIND   a plugin that works, to be changed into one's own
  mvreg inspect [FOLDER]   the table of a finished run, by default of the newest
  mvreg add [RUN]          register the scans that have come since; those in the model stay
  mvreg export RUN FORMAT...   a finished run for other programs; mvreg export --list
  mvreg report [RUN]       report.html of a finished run once more
  mvreg report --poses FILE DIR     judge poses that something else found of the scans in DIR
  mvreg view [RUN]         open a run: report.html in a browser, or run.rrd in rerun
  mvreg compare [RUNS ...] [--out FILE]  a table over runs: medians, spread, the best
  mvreg store [clear]      where finished work is kept, and how much; clear removes it
  mvreg --version

Examples:
  mvreg                                      the default method on the built-in figurine
  mvreg +method=fcpma dataset=bunny          the Stanford Bunny, downloaded if need be
  mvreg dataset=folder dataset.path=DIR      your own scans, in any order
  mvreg +method=fcpma dataset=bunny dataset.order=shuffle rng=1
  mvreg -m +method=ocpma,fcpma dataset=bunny,dragon     a run for each combination
  mvreg -m +experiment=table1                the runs behind a table of the paper
  mvreg export runs/bunny/auto/latest tum laz    poses as TUM's trajectory, the model as LAZ
  mvreg +method=fcpma --cfg job              show the configuration, run nothing

Choices:
{choices}

Keys:
  KIND.PARAMETER=VALUE   a parameter of a stage; mvreg plugins lists them: seed.top_fraction=0.5
  rng=0                  everything random follows from this number
  rerun=true             write run.rrd, a recording for the rerun viewer
  export=[]              formats to write to RUN/export at the end: export=[las,tum]
  executor=threads       who works: threads, dask (a cluster), shards; shard=2/8 is a share of it
  store=true             keep finished work, and find it when the same is asked again; or store=DIR
  resume=false           leave out a run whose folder has an answer already; experiments do
  debug=false            show the traceback of an error

A run writes runs/DATASET/METHOD/TIME/: result.json, poses, pairs.csv, model.ply, run.rrd.
Exit codes: 0 every scan placed; 3 some scans not placed; 2 wrong input; 1 a bug; 130 Ctrl-C.
More of Hydra's options: mvreg --hydra-help
"""


def usage() -> int:
    """Print the help; Hydra's own would take two seconds to list the choices."""
    from mvreg.config.presets import choices
    from mvreg.contracts import KINDS

    lines = [
        f"  {'' if group in KINDS else '+'}{group}={'|'.join(names)}"
        for group, names in choices().items()
    ]
    sys.stdout.write(USAGE.format(choices="\n".join(map(wrapped, lines))))
    return 0


def wrapped(line: str) -> str:
    """A long list of choices in several lines, broken after a bar."""
    cut = line.rfind("|", 0, WIDTH) + 1
    if len(line) <= WIDTH or not cut:
        return line
    return f"{line[:cut]}\n" + wrapped(f"      {line[cut:]}")


def version() -> int:
    """Print the version."""
    from mvreg._version import __version__

    sys.stdout.write(f"mvreg {__version__}\n")
    return 0


def plugins(arguments: Sequence[str]) -> int:
    """Print every stage: name, description, parameters with their defaults, who registered it.

    Below them what plugins bring besides: formats in and out, observers.
    """
    if arguments[:1] == ["check"]:
        from mvreg.cli.checking import check

        return check(arguments[1:])
    from inspect import getdoc  # late: --help does without

    parser = argparse.ArgumentParser(
        "mvreg plugins", description=getdoc(plugins),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="mvreg plugins check [NAME] checks that they do what their contracts ask",
    )  # fmt: skip
    parser.add_argument("kind", nargs="?", help="list this kind alone, such as refine")
    sys.stdout.write(listing(parser.parse_args(arguments).kind))
    return 0


def listing(kind: str | None = None) -> str:
    """The text of `plugins`.

    Raises
    ------
    InputError
        If there is no such kind; lists them.
    """
    from mvreg.contracts import KINDS
    from mvreg.plugins.manager import stages

    if kind is not None and kind not in KINDS:
        raise InputError(f"{kind!r} is not a kind of stage; kinds: {', '.join(KINDS)}")
    lines = []
    for each, protocol in KINDS.items():
        if kind not in (None, each):
            continue
        lines.append(f"{each}: {(protocol.__doc__ or '').splitlines()[0]}")
        for stage in stages().values():
            if stage.kind == each:
                lines.append(f"  {each}={stage.name}  [{stage.plugin}, {stage.origin}]")
                lines.append(f"      {stage.summary}")
                lines += [f"      {each}.{k}={shown(v)}" for k, v in stage.parameters.items()]
        lines.append("")
    if kind is None:
        from mvreg.cli.besides import besides

        lines += besides()
    return "\n".join(lines)


def shown(value: object) -> str:
    """A default as one would write it on the command line."""
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, bool):
        return str(value).lower()
    return "null" if value is None else str(value) or "''"


def inspect(arguments: Sequence[str]) -> int:
    """Print the table of a finished run, by default of the newest below runs/."""
    parser = argparse.ArgumentParser("mvreg inspect", description=inspect.__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="a run folder")
    folder = parser.parse_args(arguments).folder
    from mvreg.report.json_file import load_report
    from mvreg.report.table import render

    folder = newest(Path("runs")) if folder is None else folder
    render(load_report(folder), folder)
    return 0


def newest(runs: Path) -> Path:
    """The folder of the run that ended last.

    Raises
    ------
    InputError
        If there is none.
    """
    reports = [file for file in runs.rglob("result.json") if not file.parent.is_symlink()]
    if not reports:
        raise InputError(
            f"no finished run below {runs.resolve()}; run mvreg first, or name a run folder: "
            "mvreg inspect FOLDER"
        )
    return max(reports, key=lambda file: file.stat().st_mtime).parent
