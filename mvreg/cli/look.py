"""``mvreg look``: what a folder of scans holds, and what looks wrong, without a run."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from mvreg.cli.spelling import quoted_paths
from mvreg.errors import InputError
from mvreg.memory import give_back_arrays
from mvreg.types import Input, ScanSet
from mvreg.types.figures import significant

if TYPE_CHECKING:
    from rich.table import Table

USAGE = """\
Usage: mvreg look FOLDER [dataset.KEY=VALUE ...]
       mvreg look dataset=NAME [dataset.KEY=VALUE ...]

Shows what is read of a folder of scans or another data set: points, extent (the sides of the
bounding box), spacing (mean distance to the nearest point), attributes, who told where the sensor
was; which files are left out, and why; and what looks wrong. Exit codes: 0; 2 if it cannot be read.
"""


def look(arguments: Sequence[str]) -> int:
    """Print what a folder holds."""
    if {"-h", "--help"} & set(arguments):
        sys.stdout.write(USAGE)
        return 0
    give_back_arrays()
    show(loaded(arguments), sys.stdout)
    return 0


def loaded(words: Sequence[str]) -> ScanSet:
    """The scans that the command line names.

    Raises
    ------
    InputError
        If it names none, or they cannot be read.
    """
    from mvreg.config.compose import compose
    from mvreg.config.overrides import spelled
    from mvreg.run import load_scans

    folders = [word for word in words if "=" not in word or Path(word).expanduser().is_dir()]
    changes = [word for word in words if word not in folders]
    if len(folders) > 1 or not words:
        raise InputError(
            f"mvreg look: expected one folder, got {', '.join(folders) or 'none'}; quote a name "
            "with blanks: mvreg look 'my scans'"
        )
    if folders:
        changes = ["dataset=folder", f"dataset.path={spelled(folders[0])}", *changes]
    config = compose(quoted_paths(changes))
    return load_scans(config, config.rng)


def show(scanset: ScanSet, file: TextIO) -> None:
    """Print a table of the scans, then what was left out and what looks wrong."""
    from mvreg.datasets.inspection import inspect_scans
    from mvreg.report.input_rows import finding_row, said, what_was_read
    from mvreg.report.table import open_console
    from mvreg.surface.largest_range import remark_on_largest_range

    found = scanset.input or Input(0, {}, inspect_scans(scanset.scans))
    console = open_console(file)
    console.print(table(scanset))
    console.print("")
    console.print(f"{scanset.name}: {what_was_read(scanset)}", soft_wrap=True)
    remarks = [*scanset.remarks, *remark_on_largest_range(scanset.scans)]
    for remark in remarks:
        console.print(f"remark: {remark}", style="yellow", soft_wrap=True)
    for finding in found.findings:
        console.print(said(finding_row(finding)), style="bold red", soft_wrap=True)
    if not found.findings:
        console.print("nothing looks wrong" + (" besides" if remarks else ""), style="green")


def table(scanset: ScanSet) -> Table:
    """A row per scan."""
    from rich import box
    from rich.table import Table

    from mvreg.parallel import in_threads
    from mvreg.report.formatting import unit_name
    from mvreg.report.input_rows import attributes_of, number_of_points

    shown = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    shown.add_column("scan", overflow="fold")
    for heading in ("points", f"extent ({unit_name(scanset.unit)})", "spacing"):
        shown.add_column(heading, justify="right")
    shown.add_column("sensor")
    shown.add_column("attributes")
    spacings = in_threads(lambda scan: scan.spacing, scanset.scans)
    for scan, spacing in zip(scanset.scans, spacings, strict=True):
        sides = np.ptp(scan.points, axis=0)
        shown.add_row(
            scan.name, f"{number_of_points(scan):,}",
            " x ".join(significant(side, 4) for side in sides),
            significant(spacing), scanset.sensor_of(scan), ", ".join(attributes_of(scan)) or "-",
        )  # fmt: skip
    return shown
