"""The table that ends a run, made from a report alone, so that ``inspect`` shows the same."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from mvreg.report import formatting
from mvreg.report.summary import totals

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

Row = Mapping[str, Any]
#: Where there is no terminal nothing needs to be squeezed.
FILE_WIDTH = 200
STYLES = {
    "reference": "cyan", "placed": "green", "apart": "yellow",
    "not placed": "bold red", "ambiguous": "bold red",
}  # fmt: skip


def render(
    report: Mapping[str, Any], folder: Path | None = None, file: TextIO | None = None
) -> None:
    """Print a report: a row per scan, a table per partial model, then the totals.

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
    apart = [int(part["number"]) for part in report.get("components") or []]
    rows = report.get("scans", [])
    console.print(scan_table(report, [row for row in rows if row.get("component") not in apart]))
    for part in report.get("components") or []:
        chosen = [row for row in rows if row.get("component") == part["number"]]
        console.print(_heading(part, chosen))
        console.print(scan_table(report, chosen))
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


def scan_table(report: Mapping[str, Any], rows: Sequence[Row]) -> Table:
    """A row per scan: status, what the scans say of its pose, errors where there is a truth.

    It is at most 100 columns wide for names of up to 24 characters.
    """
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    # As wide in all the tables of a report, so that their columns stand below each other.
    names = max((len(str(row.get("name"))) for row in report.get("scans", [])), default=0)
    table.add_column("scan", overflow="fold", min_width=min(names, 24))
    table.add_column("status", min_width=10)
    for heading in _headings(report):
        # Room for 99.999, in all the tables alike.
        width = 6 if "\n" in heading else None
        table.add_column(heading, justify="right", vertical="bottom", min_width=width)
    for row in rows:
        table.add_row(*_cells(row, report))
    return table


def _heading(part: Row, rows: Sequence[Row]) -> Text:
    from rich.text import Text

    scans = formatting.count(len(rows), "scan")
    text = f"\ncomponent {part['number']}: {scans}, in the frame of {part.get('reference')}\n"
    return Text(text, style="bold")


def _headings(report: Mapping[str, Any]) -> list[str]:
    unit = formatting.unit(report).replace(" ", "\n")
    if _assessed(report):
        headings = ["grade", "conf.", "covered", "inlier\nratio", "weakest\naxis", f"RMS\n({unit})"]
    else:
        headings = ["overlap", f"trimmed\nRMSE\n({unit})"]
    if _has_errors(report):
        headings += ["error\n(deg)", f"error\n({unit})"]
    return headings


def _assessed(report: Mapping[str, Any]) -> bool:
    """False for a report from before scans were assessed."""
    return any(row.get("assessment") for row in report.get("scans", []))


def _has_errors(report: Mapping[str, Any]) -> bool:
    parts = [report, *(report.get("components") or [])]
    return any(part.get("errors") for part in parts)


def _cells(row: Row, report: Mapping[str, Any]) -> list[str | Text]:
    from rich.text import Text

    status = row.get("status", "?")
    if status.startswith("component"):
        status = "apart"  # the heading has the number
    # In capitals, so that it stands out without colours too.
    shown = status.upper() if status in ("not placed", "ambiguous") else status
    cells: list[str | Text] = [str(row.get("name")), Text(shown, style=STYLES.get(status, ""))]
    if _assessed(report):
        cells += _assessment_cells(row.get("assessment") or {}, report)
    else:
        cells += [formatting.number(row.get("overlap"), ".2f")]
        cells += [formatting.length(row.get("trimmed_rmse"), report)]
    if _has_errors(report):
        errors = row.get("errors") or {}
        cells.append(formatting.number(errors.get("angle_deg"), ".3f"))
        cells.append(formatting.length(errors.get("translation"), report))
    return cells


def _assessment_cells(found: Row, report: Mapping[str, Any]) -> list[str | Text]:
    from rich.text import Text

    word, style = formatting.GRADES.get(str(found.get("grade")), ("-", ""))
    return [
        Text(word, style=style),
        formatting.confidence(found.get("confidence")),
        formatting.number(found.get("coverage"), ".2f"),
        formatting.number(found.get("inlier_ratio"), ".2f"),
        formatting.number(min(found.get("strength") or [None]), ".2f"),
        formatting.length(found.get("rms"), report),
    ]
