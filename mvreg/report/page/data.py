"""Everything that the page shows, as plain values: made from a report and the scans."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.evaluation.residuals import point_residuals
from mvreg.evaluation.survey import level_of_accuracy
from mvreg.geometry import se3
from mvreg.report import formatting
from mvreg.report.page import words
from mvreg.report.page.graph import layout
from mvreg.report.page.sections import Section, sections
from mvreg.report.page.shown import WORST, packed, shown_points
from mvreg.types import Array, ScanSet, View

Row = dict[str, Any]
#: Attempts shown of a scan that was not placed, and bars of the histogram.
HYPOTHESES, BARS = 3, 40
#: Of more links than this those of least confidence are listed, and drawn.
MOST_LINKS = 3000


@dataclass(frozen=True, eq=False)
class PageData:
    """What the template gets: `report` as in ``result.json``, and what is derived from it."""

    report: Mapping[str, Any]
    verdict: str
    steps: Sequence[str]
    scans: Sequence[Row]
    links: Sequence[Row]
    loops: Sequence[Row]
    trees: Sequence[int]
    refused: Sequence[Row]
    nodes: Mapping[str, tuple[float, float]]
    scenes: Sequence[Row]
    lost: Sequence[Row]
    sections: Sequence[Row]
    histogram: Row
    overrides: Sequence[str]
    points: Mapping[str, Any]
    unit: str


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
    models = _models(report)
    resolution = float(report.get("resolution") or 0.0)
    residuals: dict[str, Array] = {}
    for poses in models:
        residuals |= point_residuals(poses, views)
    shown = shown_points(scanset.scans, views, residuals)
    colours = {scan.name: colour(k) for k, scan in enumerate(scanset.scans)}
    middles = {
        one.name: se3.apply(models[0][one.name], one.points.mean(axis=0)[None])[0]
        for one in shown if one.name in models[0]
    }  # fmt: skip
    rows = sorted((dict(row) for row in report.get("scans") or []), key=words.importance)
    links = [dict(link) for link in report.get("links") or []]
    degree = {
        str(row["name"]): sum(row["name"] in (link["source"], link["target"]) for link in links)
        for row in rows
    }
    loops = [dict(loop) for loop in report.get("loops") or []]
    numbers = range(1, len(models) + 1)
    scenes, lost = _scenes(report, models, rows)
    names = [str(row["name"]) for row in rows]
    refused = _refused(report)
    return PageData(
        report=report,
        verdict=words.verdict(report),
        steps=words.next_steps(report),
        scans=[
            _scan(row, report, colours, degree, (hashes or {}).get(str(row["name"])))
            for row in rows
        ],
        links=sorted((_link(link, report) for link in links), key=_doubtful)[:MOST_LINKS],
        loops=[_loop(loop, report) for loop in loops],
        trees=[
            number for number, poses in zip(numbers, models, strict=True)
            if len(poses) > 1 and not any(loop["component"] == number for loop in loops)
        ],
        refused=refused,
        nodes=layout(names, [(a["source"], a["target"]) for a in links], middles),
        scenes=scenes,
        lost=lost,
        sections=[
            _drawn(one, colours, report)
            for one in sections(models[0], views, residuals, shown)
        ],
        histogram=_histogram(residuals, report),
        overrides=list(overrides),
        points={
            "worst": WORST * resolution,
            "upright": flat(_upright(scanset, report, models[0])),
            "scans": {
                one.name: packed(one, resolution) | {"colour": colours[one.name]} for one in shown
            },
        },
        unit=formatting.unit(report),
    )  # fmt: skip


def colour(number: int) -> str:
    """A colour for the scan of this number, far from those before it: ``#rrggbb``."""
    hue = (0.58 + number * 0.61803398875) % 1.0
    light = 0.46 if number % 2 else 0.58
    red, green, blue = colorsys.hls_to_rgb(hue, light, 0.62)
    return "#" + "".join(f"{round(255 * part):02x}" for part in (red, green, blue))


def _models(report: Mapping[str, Any]) -> list[dict[str, Array]]:
    parts = [report.get("poses") or {}, *(p["poses"] for p in report.get("components") or [])]
    return [
        {name: np.asarray(pose, dtype=np.float64) for name, pose in part.items()} for part in parts
    ]


def _scan(
    row: Row,
    report: Mapping[str, Any],
    colours: Mapping[str, str],
    degree: Mapping[str, int],
    digest: str | None,
) -> Row:
    name = str(row["name"])
    found = row.get("assessment") or {}
    axes = (found.get("uncertainty") or {}).get("axes_95")
    if axes and not any(axes):
        axes = None  # the scan that fixes the frame
    widest = max(axes) if axes else None
    return row | {
        "colour": colours.get(name, "#888888"),
        "grade": words.grade(row) or "none",
        "grade_colour": GRADE_COLOURS[words.grade(row) or "none"],
        "doubt": words.doubt(row),
        "links": degree.get(name, 0),
        "confidence": found.get("confidence"),
        "coverage": found.get("coverage"),
        "inlier_ratio": found.get("inlier_ratio"),
        "rms": found.get("rms"),
        "strength": min(found.get("strength") or [None]),
        "axes_95": axes,
        "level": None if widest is None else level_of_accuracy(widest, str(report.get("unit"))),
        "digest": digest,
    }  # fmt: skip


GRADE_COLOURS = {"green": "#1a7f37", "amber": "#9a6700", "red": "#c2281d", "none": "#6b7280"}


def _link(link: Row, report: Mapping[str, Any]) -> Row:
    axis = link.get("weakest_axis")
    named = "-" if not axis else "xyz"[int(np.argmax(np.abs(axis)))]
    slanted = axis and max(abs(part) for part in axis) < 0.9
    level = link.get("p95") is not None and level_of_accuracy(link["p95"], str(report.get("unit")))
    return link | {"axis": f"{named}, slanted" if slanted else named, "level": level or None}


def _doubtful(link: Row) -> float:
    confidence = link.get("confidence")
    return 1.0 if confidence is None else float(confidence)


def _loop(loop: Row, report: Mapping[str, Any]) -> Row:
    return loop | {"level": level_of_accuracy(loop["translation"], str(report.get("unit")))}


def _refused(report: Mapping[str, Any]) -> list[Row]:
    """The attempts that were refused, those of most confidence first."""
    found = [dict(pair) for pair in report.get("pairs") or [] if pair["verdict"] == "rejected"]
    return sorted(found, key=lambda pair: -(pair.get("confidence") or 0.0))[:MOST_LINKS]


def _scenes(
    report: Mapping[str, Any], models: Sequence[Mapping[str, Array]], rows: Sequence[Row]
) -> tuple[list[Row], list[Row]]:
    """What the view in three dimensions can show; and the scans not placed with their attempts."""
    scenes = [
        {"title": "the model" if number == 1 else f"component {number}",
         "items": [{"scan": name, "pose": flat(pose)} for name, pose in poses.items()]}
        for number, poses in enumerate(models, start=1)
    ]  # fmt: skip
    everything = [str(row["name"]) for row in rows]
    scenes.append({
        "title": "before: as the files have them",
        "items": [{"scan": name, "pose": flat(np.eye(4))} for name in everything],
    })  # fmt: skip
    lost = []
    for row in rows:
        if row.get("status") not in words.LOST:
            continue
        name = str(row["name"])
        tried = [
            pair for pair in report.get("pairs") or []
            if name in (pair["source"], pair["target"]) and pair.get("T_target_source")
        ]  # fmt: skip
        best = sorted(tried, key=lambda pair: -(pair.get("confidence") or 0.0))[:HYPOTHESES]
        for pair in best:
            scenes.append({
                "title": f"{pair['source']} on {pair['target']}, refused",
                "items": [
                    {"scan": pair["target"], "pose": flat(np.eye(4))},
                    {"scan": pair["source"], "pose": flat(np.asarray(pair["T_target_source"]))},
                ],
            })  # fmt: skip
        first = len(scenes) - len(best)
        lost.append({
            "name": name, "doubt": words.doubt(row), "status": row.get("status"),
            "attempts": [dict(pair) | {"scene": first + k} for k, pair in enumerate(best)],
        })  # fmt: skip
    return scenes, lost


def flat(pose: Array) -> list[float]:
    """A pose row by row."""
    return [float(value) for value in pose.reshape(-1)]


def _upright(scanset: ScanSet, report: Mapping[str, Any], poses: Mapping[str, Array]) -> Array:
    """The rotation (4, 4) that turns the model's vertical to +z, and -y towards the viewer.

    The vertical is that of a levelled scan; where there is none, the viewer is where the sensor of
    the reference was, and +y, as cameras have it, is up.
    """
    scans = [scan for scan in scanset.scans if scan.name in poses]
    up, front = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    levelled = next((scan for scan in scans if scan.up is not None), None)
    first = next((scan for scan in scans if scan.name == report.get("reference")), None)
    if levelled is not None and levelled.up is not None:
        up = poses[levelled.name][:3, :3] @ levelled.up
        front = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    elif first is not None and first.view_direction is not None:
        front = poses[first.name][:3, :3] @ first.view_direction
        y = poses[first.name][:3, 1]
        up = y if abs(y @ front) < 0.9 else poses[first.name][:3, 2]
    up = up - (up @ front) * front if levelled is None else up
    up, front = up / np.linalg.norm(up), front / np.linalg.norm(front)
    found = np.eye(4)
    found[:3, :3] = np.stack([np.cross(up, front), -front, up])
    return found


def _histogram(residuals: Mapping[str, Array], report: Mapping[str, Any]) -> Row:
    """Counts of residuals in `BARS` bars, up to three times their tolerance."""
    known = [values[np.isfinite(values)] for values in residuals.values()]
    values = np.concatenate(known) if known else np.empty(0)
    tolerance = (report.get("grades") or {}).get("tolerance")
    if not len(values) or not tolerance:
        return {"counts": [], "top": 0.0, "tolerance": 0.0, "share": 0.0}
    top = 3 * float(tolerance)
    counts = np.histogram(np.minimum(values, top * (1 - 1e-9)), BARS, (0, top))[0]
    return {
        "counts": counts.tolist(), "top": top, "tolerance": float(tolerance),
        "share": float((values <= tolerance).mean()), "median": float(np.median(values)),
        "p95": float(np.quantile(values, 0.95)),
    }  # fmt: skip


def _drawn(one: Section, colours: Mapping[str, str], report: Mapping[str, Any]) -> Row:
    """A section as paths of SVG, in squares of 1000 by 1000."""
    extent = max((float(np.abs(points).max()) for points in one.whole.values()), default=one.half)
    extent = max(extent, one.half)
    return {
        "apart": formatting.length(one.apart, report),
        "half": formatting.length(one.half, report),
        "box": 500 * one.half / extent,
        "whole": _paths(one.whole, extent, colours),
        "enlarged": _paths(one.enlarged, one.half, colours),
    }


def _paths(points: Mapping[str, Array], half: float, colours: Mapping[str, str]) -> list[Row]:
    found = []
    for name, flat_points in points.items():
        places = np.round(500 + 500 * flat_points * [1, -1] / half).astype(int)
        places = np.unique(places, axis=0)
        found.append({
            "name": name, "colour": colours.get(name, "#888888"),
            "path": "".join(f"M{x} {y}h0" for x, y in places.tolist()),
        })  # fmt: skip
    return found
