"""The view graph as it is drawn: where its nodes are, and how its lines look."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mvreg.report.page.layout import layout
from mvreg.types import Array

#: The drawing's width and height.
WIDE, HIGH = 800, 600
#: Confidences from which a link is green, and brown; below, it is grey.
SURE, LIKELY = 0.95, 0.5
SHADES = {SURE: "#1a7f37", LIKELY: "#9a6700", -1.0: "#8b93a1"}
#: Of more links than this the sure ones are drawn as a few shapes, without names of their own;
#: lines become thinner where there are more than so many.
SINGLE, THICK = 500, 150
#: Of more scans than this only those are labelled that are not green, and so many at most.
LABELLED, MOST_LABELS = 60, 40
#: Names stand so far below their nodes, and cross the border if they are not further from it.
BELOW, BORDER = 27, 180


@dataclass(frozen=True)
class Line:
    """Links that are drawn alike: `path` as of SVG, in a colour and a width; of which, if one."""

    path: str
    colour: str
    width: float
    link: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Label:
    """Where the name of a scan stands, below its node, and how: SVG's ``text-anchor``."""

    x: float
    y: float
    anchor: str


@dataclass(frozen=True)
class Graph:
    """The view graph: places of the scans, lines, the surest first, and labels by scan.

    `radius` is that of a node, `opacity` that of the lines.
    """

    nodes: Mapping[str, tuple[float, float]]
    lines: Sequence[Line]
    labels: Mapping[str, Label]
    radius: int
    opacity: float


def graph(
    scans: Sequence[Mapping[str, Any]],
    links: Sequence[Mapping[str, Any]],
    start: Mapping[str, Array],
) -> Graph:
    """Draw the view graph.

    Parameters
    ----------
    scans : sequence of mapping
        With `name` and `grade`, the doubtful ones first.
    links : sequence of mapping
        As ``links[]`` of ``result.json``, the least certain first.
    start : mapping of str to (3,) array
        Where scans are in the model.
    """
    names = [str(scan["name"]) for scan in scans]
    unit = layout(names, [(link["source"], link["target"]) for link in links], start)
    nodes = {name: (round(WIDE * x, 1), round(HIGH * y, 1)) for name, (x, y) in unit.items()}
    few = len(names) < LABELLED
    doubtful = [str(scan["name"]) for scan in scans if scan["grade"] != "green"]
    labels = {name: _label(*nodes[name]) for name in (names if few else doubtful[:MOST_LABELS])}
    opacity = 0.75 if len(links) <= SINGLE else 0.45
    return Graph(nodes, _lines(links, nodes), labels, 10 if few else 5, opacity)


def _label(x: float, y: float) -> Label:
    """Names near the left and right border begin, and end, there."""
    if BORDER <= x <= WIDE - BORDER:
        return Label(x, y + BELOW, "middle")
    return Label(x - 12, y + BELOW, "start") if x < BORDER else Label(x + 12, y + BELOW, "end")


def _lines(
    links: Sequence[Mapping[str, Any]], nodes: Mapping[str, tuple[float, float]]
) -> list[Line]:
    """The surest first: those below do not hide the doubtful ones."""
    thin = min(1.0, (THICK / max(len(links), 1)) ** 0.5)
    single: list[Line] = []
    alike: dict[tuple[str, float], list[str]] = {}
    for link in reversed(links):
        (x, y), (z, w) = nodes[link["source"]], nodes[link["target"]]
        width = thin * (0.6 + 6 * float(link.get("contact_ratio") or 0.0))
        shade, path = _shade(link), f"M{x} {y}L{z} {w}"
        if len(links) > SINGLE and shade == SHADES[SURE]:
            alike.setdefault((shade, max(0.3, round(2 * width) / 2)), []).append(path)
        else:
            single.append(Line(path, shade, round(width, 2), link))
    joined = [Line("".join(paths), *look) for look, paths in sorted(alike.items())]
    return [*joined, *single]


def _shade(link: Mapping[str, Any]) -> str:
    confidence = link.get("confidence")
    known = 0.0 if confidence is None else float(confidence)
    return next(shade for least, shade in SHADES.items() if known >= least)
