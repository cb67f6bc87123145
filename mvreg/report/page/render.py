"""Write the page: a template filled in, with its style and its script inside."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.evaluation.survey import LEVELS
from mvreg.parallel import in_threads
from mvreg.report import formatting
from mvreg.report.page.colours import GRADE_COLOURS
from mvreg.report.page.data import PageData, page_data
from mvreg.report.run_folder import overrides_of, write_text
from mvreg.types import Scan, ScanSet, View

#: The page of a run, in its folder.
NAME = "report.html"
#: Links that are listed at once; the others wait until they are asked for, as rows take long.
AT_FIRST = 200


def write_page(
    folder: Path, report: Mapping[str, Any], scanset: ScanSet, views: Sequence[View]
) -> Path:
    """Write ``report.html`` into a run's folder.

    Parameters
    ----------
    folder : Path
    report : mapping
        As in ``result.json``.
    scanset : ScanSet
    views : sequence of View

    Returns
    -------
    Path
        The file.
    """
    digests = {} if report.get("status") == "running" else hashes(scanset.scans)
    data = page_data(report, scanset, views, overrides_of(folder), digests)
    path = folder / NAME
    write_text(path, render_page(data))
    return path


def render_page(data: PageData) -> str:
    """The page as HTML, complete in itself."""
    from jinja2 import Environment, StrictUndefined

    report = data.report
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    filters: dict[str, Callable[..., object]] = {
        "length": lambda value: formatting.length(value, report),
        "short": lambda value: formatting.number(value, ".3f" if report["unit"] == "mm" else ".2g"),
        "counted": lambda word, items: formatting.count(items, word),
        "share": lambda value: formatting.number(value, ".2f"),
        "sure": formatting.confidence,
        "length_of": len,
        "degrees": lambda value: formatting.number(value, ".3f"),
    }
    environment.filters.update(filters)
    template = environment.from_string(_file("page.html"))
    grade_of = {str(row["name"]): row["grade_colour"] for row in data.scans}
    scans = {
        name: scan | {"grade": grade_of.get(name, GRADE_COLOURS["none"])}
        for name, scan in data.points["scans"].items()
    }
    return template.render(
        points={**data.points, "scans": scans}, data=data, report=report, levels=LEVELS,
        grades=GRADE_COLOURS, at_first=AT_FIRST,
        style=_file("page.css"), script=_file("page.js"), viewer=_file("viewer.js"),
    )  # fmt: skip


def hashes(scans: Sequence[Scan]) -> dict[str, str]:
    """SHA-256 of the points of every scan as doubles, in the frame that they were registered in."""
    return dict(in_threads(lambda scan: (scan.name, _digest(scan)), scans))


def _digest(scan: Scan) -> str:
    return hashlib.sha256(np.ascontiguousarray(scan.points, dtype="<f8").data).hexdigest()


def _file(name: str) -> str:
    return (resources.files("mvreg.report.page") / name).read_text(encoding="utf-8")
