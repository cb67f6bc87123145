"""``mvreg add``: register what has come into a folder since, to what stands already."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mvreg.errors import InputError


def add(arguments: Sequence[str]) -> int:
    """Register the scans of a run's data set that are not in its model; those that are stay."""
    parser = argparse.ArgumentParser(
        "mvreg add", description=add.__doc__, usage="mvreg add [RUN] [KEY=VALUE ...]"
    )
    parser.add_argument("words", nargs="*", metavar="RUN", help="a run folder, by default the "
                        "newest below runs/; then as for a run")  # fmt: skip
    words: list[str] = parser.parse_args(arguments).words
    from mvreg.cli.listing import newest
    from mvreg.cli.main import run_hydra
    from mvreg.config.finished import where_it_ran

    named = words[:1] if words and ("=" not in words[0] or Path(words[0]).is_dir()) else []
    folder = (Path(named[0]) if named else newest(Path("runs"))).resolve()
    asked = [*holding(folder), *words[len(named) :]]
    sys.stderr.write(f"adding to {folder}: the scans in its model keep their poses\n")
    with where_it_ran(folder):
        return run_hydra(asked)


def holding(folder: Path) -> list[str]:
    """What is to be run: the same again, with the poses that are known held fast.

    Raises
    ------
    InputError
        If it is no run of the command line, or nothing is placed.
    """
    from mvreg.cli.prepared import words_of
    from mvreg.config.overrides import spelled
    from mvreg.report.json_file import load_report

    placed = list(load_report(folder)["poses"])
    before = words_of(folder)
    if len(placed) < 2:
        raise InputError(f"{folder}: expected a model of two scans or more, found {len(placed)}")
    ours = ("dataset.initial=", "dataset.fixed=", "resume=")
    kept = [word for word in before if not word.lstrip("+").startswith(ours)]
    known = spelled(str(folder / "result.json"))
    return [*kept, f"dataset.initial={known}", f"dataset.fixed=[{','.join(map(spelled, placed))}]"]
