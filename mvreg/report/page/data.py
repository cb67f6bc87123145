"""Everything that the page shows, as plain values: made from a report and the scans."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mvreg.evaluation.residuals import point_residuals
from mvreg.evaluation.survey import MILLIMETRES, level_of_accuracy
from mvreg.geometry import se3
from mvreg.report import formatting
from mvreg.report.page import words
from mvreg.report.page.colours import GRADE_COLOURS, GREY, colour
from mvreg.report.page.drawings import drawn, histogram
from mvreg.report.page.graph import Graph, graph
from mvreg.report.page.pairs import link_rows, loop_rows, refused_rows
from mvreg.report.page.scenes import flat, models_of, scenes, upright
from mvreg.report.page.sections import sections
from mvreg.report.page.shown import WORST, Shown, packed, shown_points
from mvreg.types import Array, ScanSet, View

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class PageData:
    """What the template gets: `report` as in ``result.json``, and what is derived from it.

    Levels of accuracy are shown if it is `leveled`: where the unit of length is known.
    """

    report: Mapping[str, Any]
    verdict: str
    steps: Sequence[str]
    hint: str | None
    scans: Sequence[Row]
    links: Sequence[Row]
    loops: Sequence[Row]
    trees: Sequence[int]
    refused: Sequence[Row]
    graph: Graph
    scenes: Sequence[Row]
    lost: Sequence[Row]
    sections: Sequence[Row]
    histogram: Row
    overrides: Sequence[str]
    points: Mapping[str, Any]
    unit: str
    leveled: bool


def page_data(
    report: Mapping[str, Any],
    scanset: ScanSet,
    views: Sequence[View],
    overrides: Sequence[str] = (),
    hashes: Mapping[str, str] | None = None,
) -> PageData:
    """Put the page together.

    Parameters
    ----------
    report : mapping
        As in ``result.json``.
    scanset : ScanSet
        The scans that the report is of.
    views : sequence of View
        As they were prepared, for residuals and sections.
    overrides : sequence of str
        What was said on the command line.
    hashes : mapping of scan name to str, optional
        SHA-256 of the points of each scan.
    """
    models = models_of(report)
    residuals: dict[str, Array] = {}
    judged = report.get("status") != "running"
    for poses in models if judged else []:
        residuals |= point_residuals(poses, views)
    shown = shown_points(scanset.scans, views, residuals)
    colours = {scan.name: colour(k) for k, scan in enumerate(scanset.scans)}
    rows = sorted((dict(row) for row in report.get("scans") or []), key=words.importance)
    links, loops = link_rows(report), loop_rows(report)
    shows, lost = scenes(report, models, rows)
    scans = _scans(rows, report, colours, hashes or {})
    return PageData(
        report=report,
        verdict=words.verdict(report),
        steps=words.next_steps(report),
        hint=words.hint(report),
        scans=scans,
        links=links,
        loops=loops,
        trees=_trees(models, loops) if judged else [],
        refused=refused_rows(report),
        graph=graph(scans, links, _middles(shown, models[0])),
        scenes=shows,
        lost=lost,
        sections=[
            drawn(one, colours, report) for one in sections(models[0], views, residuals, shown)
        ],
        histogram=histogram(residuals, report),
        overrides=list(overrides),
        points={
            "worst": WORST * float(report.get("resolution") or 0.0),
            "upright": flat(upright(scanset, report, models[0])),
            "scans": _packed(shown, colours, report),
        },
        unit=formatting.unit(report),
        leveled=report.get("unit") in MILLIMETRES,
    )


def _middles(shown: Sequence[Shown], poses: Mapping[str, Array]) -> dict[str, Array]:
    """The middle (3,) of each placed scan in the model."""
    return {
        one.name: se3.apply(poses[one.name], one.points.mean(axis=0)[None])[0]
        for one in shown
        if one.name in poses
    }


def _packed(shown: Sequence[Shown], colours: Mapping[str, str], report: Mapping[str, Any]) -> Row:
    resolution = float(report.get("resolution") or 0.0)
    return {one.name: packed(one, resolution) | {"colour": colours[one.name]} for one in shown}


def _trees(models: Sequence[Mapping[str, Array]], loops: Sequence[Row]) -> list[int]:
    """The numbers of the partial models whose links close no loop."""
    closed = {loop["component"] for loop in loops}
    return [k for k, poses in enumerate(models, start=1) if len(poses) > 1 and k not in closed]


def _scans(
    rows: Sequence[Row],
    report: Mapping[str, Any],
    colours: Mapping[str, str],
    hashes: Mapping[str, str],
) -> list[Row]:
    degree = Counter(
        str(link[end]) for link in report.get("links") or [] for end in ("source", "target")
    )
    unit, running = str(report.get("unit")), report.get("status") == "running"
    return [
        _scan(row, unit)
        | {
            "colour": colours.get(str(row["name"]), GREY),
            "doubt": words.doubt(row, running),
            "links": degree[str(row["name"])],
            "digest": hashes.get(str(row["name"])),
        }
        for row in rows
    ]


def _scan(row: Row, unit: str) -> Row:
    found = row.get("assessment") or {}
    axes = (found.get("uncertainty") or {}).get("axes_95")
    if axes and not any(axes):
        axes = None  # the scan that fixes the frame
    graded = words.grade(row) or "none"
    return row | {
        "grade": graded,
        "grade_colour": GRADE_COLOURS[graded],
        "confidence": found.get("confidence"),
        "coverage": found.get("coverage"),
        "inlier_ratio": found.get("inlier_ratio"),
        "rms": found.get("rms"),
        "strength": min(found.get("strength") or [None]),
        "axes_95": axes,
        "level": level_of_accuracy(max(axes), unit) if axes else None,
    }
