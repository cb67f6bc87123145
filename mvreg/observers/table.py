"""The table that ends a run, made from a report alone, so that ``inspect`` shows the same."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

#: Where there is no terminal nothing needs to be squeezed.
FILE_WIDTH = 200
STYLES = {"reference": "cyan", "placed": "green", "not placed": "bold red"}


def render(
    report: Mapping[str, Any], folder: Path | None = None, file: TextIO | None = None
) -> None:
    """Print a report: a row per scan, then the totals.

    Parameters
    ----------
    report : mapping
        What ``result.json`` holds.
    folder : Path, optional
        The run folder, to say where it is and how to look at it.
    file : text file, optional
        Standard output if not given. Control characters are written to a terminal only.
    """
    console = open_console(file or sys.stdout)
    console.print(scan_table(report))
    for line in totals(report, folder):
        console.print(line, soft_wrap=True)


def open_console(file: TextIO) -> Console:
    """A rich console that leaves names with brackets alone and is plain where nobody looks."""
    from rich.console import Console

    live = file.isatty()
    return Console(
        file=file,
        force_terminal=live,
        width=None if live else FILE_WIDTH,
        markup=False,
        highlight=False,
        emoji=False,
    )


def scan_table(report: Mapping[str, Any]) -> Table:
    """A row per scan: status, overlap, trimmed RMSE, and errors where there is a truth."""
    from rich import box
    from rich.table import Table

    unit = _unit(report)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("scan", overflow="fold")
    table.add_column("status")
    headings = ["overlap", f"trimmed RMSE ({unit})"]
    if report.get("errors"):
        headings += ["rotation error (deg)", f"translation error ({unit})"]
    for heading in headings:
        table.add_column(heading, justify="right")
    for row in report.get("scans", []):
        table.add_row(*_cells(row, report))
    return table


def totals(report: Mapping[str, Any], folder: Path | None = None) -> list[str | Text]:
    """The lines below the table."""
    from rich.text import Text

    scans = report.get("scans", [])
    seconds = report.get("seconds") or {}
    placed, pairs = len(report.get("poses", {})), report.get("num_pairs", 0)
    lines: list[str | Text] = [
        f"placed {placed} of {len(scans)} scans with {pairs} pairs in "
        f"{_number(seconds.get('total'), '.2f')} s "
        f"(loading {_number(seconds.get('load'), '.2f')} s)"
    ]
    if report.get("status") == "interrupted":
        lines.insert(0, Text("interrupted: this is what was finished", style="bold red"))
    lines += _error_lines(report) + _consistency_lines(report)
    for row in scans:
        if row.get("status") == "not placed":
            lines.append(Text(_why_not(row), style="red"))
    return lines + (_folder_lines(folder) if folder else [])


def _cells(row: Mapping[str, Any], report: Mapping[str, Any]) -> list[str | Text]:
    from rich.text import Text

    status = row.get("status", "?")
    # In capitals, so that it stands out without colours too.
    shown = "NOT PLACED" if status == "not placed" else status
    cells: list[str | Text] = [
        str(row.get("name")),
        Text(shown, style=STYLES.get(status, "")),
        _number(row.get("overlap"), ".2f"),
        _length(row.get("trimmed_rmse"), report),
    ]
    if report.get("errors"):
        errors = row.get("errors") or {}
        cells.append(_number(errors.get("angle_deg"), ".3f"))
        cells.append(_length(errors.get("translation"), report))
    return cells


def _error_lines(report: Mapping[str, Any]) -> list[str | Text]:
    errors = report.get("errors")
    if not errors:
        return []
    mean, most, unit = errors["mean"], errors["max"], _unit(report)
    line = (
        f"e_R {_number(mean['rotation'], '.4f')} (max {_number(most['rotation'], '.4f')}), "
        f"e_t {_length(mean['translation'], report)} {unit} "
        f"(max {_length(most['translation'], report)} {unit})"
    )
    if errors.get("frame") != report.get("reference"):
        line += f", in the frame of {errors.get('frame')}: the reference has no ground truth"
    return [line]


def _consistency_lines(report: Mapping[str, Any]) -> list[str | Text]:
    found = report.get("consistency")
    if not found:
        return []
    return [
        f"consistency: point-to-plane median {_length(found['median'], report)}, "
        f"RMS {_length(found['rms'], report)} {_unit(report)} "
        f"({_number(found['median_resolutions'], '.3f')} and "
        f"{_number(found['rms_resolutions'], '.3f')} resolutions)"
    ]


def _why_not(row: Mapping[str, Any]) -> str:
    attempts = row.get("attempts", 0)
    tried = f"{attempts} attempt{'' if attempts == 1 else 's'}"
    reason = f"; the closest: {row['reason']}" if row.get("reason") else ""
    return f"{row.get('name')} was not placed: {tried}{reason}"


def _folder_lines(folder: Path) -> list[str | Text]:
    here = Path.cwd()
    shown = folder.relative_to(here) if folder.is_relative_to(here) else folder
    lines: list[str | Text] = [f"written to {shown}"]
    if (folder / "run.rrd").exists():
        lines.append(f"see it with: rerun {shlex.quote(str(shown / 'run.rrd'))}")
    return lines


def _unit(report: Mapping[str, Any]) -> str:
    unit = report.get("unit") or "file"
    return "file units" if unit == "file" else str(unit)


def _length(value: float | None, report: Mapping[str, Any]) -> str:
    """Thousandths of a millimetre; where the unit is unknown so is the size, and digits count."""
    return _number(value, ".3f" if report.get("unit") == "mm" else ".4g")


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
