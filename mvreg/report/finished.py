"""The folder of a run whose result is there: first what counts, then what shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mvreg.report import json_file
from mvreg.report.run_folder import link_latest, write_result, write_text
from mvreg.types import Result, ScanSet, View


def write_run(folder: Path, scanset: ScanSet, result: Result, report: Mapping[str, Any]) -> Path:
    """Write poses and models, then ``result.json``: whoever sees it finds the rest complete."""
    write_result(folder, scanset, result)
    file = folder / "result.json"
    write_text(file, json_file.dumps(report))
    return file


def show_run(
    folder: Path,
    scanset: ScanSet,
    report: Mapping[str, Any],
    views: Sequence[View],
    page: bool = True,
    link: bool = True,
) -> None:
    """Write ``report.html`` if a `page` is wanted, and let ``latest`` point to it for a `link`."""
    if page:
        from mvreg.report.page.render import write_page

        write_page(folder, report, scanset, views)
    if link:
        link_latest(folder)
