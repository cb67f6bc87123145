"""Pairs of scans on the page: links, loops of them, and the attempts that were refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mvreg.evaluation.survey import level_of_accuracy

Row = dict[str, Any]
#: Of more links than this those of least confidence are listed, and drawn; of more refused pairs
#: those of most.
MOST_LINKS = 3000


def link_rows(report: Mapping[str, Any]) -> list[Row]:
    """The links of placed scans, the least certain first."""
    unit = str(report.get("unit"))
    found = [_link(dict(link), unit) for link in report.get("links") or []]
    return sorted(found, key=_confidence_of_link)[:MOST_LINKS]


def _link(link: Row, unit: str) -> Row:
    axis = link.get("weakest_axis")
    named = "-" if not axis else "xyz"[int(np.argmax(np.abs(axis)))]
    slanted = axis and max(abs(part) for part in axis) < 0.9
    level = link.get("p95") is not None and level_of_accuracy(link["p95"], unit)
    return link | {"axis": f"{named}, slanted" if slanted else named, "level": level or None}


def _confidence_of_link(link: Row) -> float:
    confidence = link.get("confidence")
    return 1.0 if confidence is None else float(confidence)


def loop_rows(report: Mapping[str, Any]) -> list[Row]:
    """The loops of links, as the report has them, with the level that each reaches."""
    unit = str(report.get("unit"))
    return [
        dict(loop) | {"level": level_of_accuracy(loop["translation"], unit)}
        for loop in report.get("loops") or []
    ]


def refused_rows(report: Mapping[str, Any]) -> list[Row]:
    """The pairs of scans of which attempts were refused, those of most confidence first."""
    pairs = report.get("pairs") or []
    return most_telling(pair for pair in pairs if pair["verdict"] == "rejected")[:MOST_LINKS]


def most_telling(attempts: Iterable[Mapping[str, Any]]) -> list[Row]:
    """One attempt for each pair of scans, whichever moved, and how many there were, as `tries`.

    It is that of most confidence; of several the one that has a pose, and then the last. The pairs
    of most confidence come first.

    Parameters
    ----------
    attempts : iterable of mapping
        As ``pairs[]`` of ``result.json``.
    """
    found: dict[frozenset[str], Row] = {}
    for attempt in attempts:
        names = frozenset((attempt["source"], attempt["target"]))
        before = found.get(names)
        tries = before["tries"] + 1 if before else 1
        best = before if before and _says_more(before, attempt) else dict(attempt)
        found[names] = best | {"tries": tries}
    return sorted(found.values(), key=lambda pair: -_confidence(pair))


def _says_more(before: Mapping[str, Any], attempt: Mapping[str, Any]) -> bool:
    known, new = _confidence(before), _confidence(attempt)
    if known != new:
        return known > new
    return bool(before.get("T_target_source")) and not attempt.get("T_target_source")


def _confidence(pair: Mapping[str, Any]) -> float:
    return float(pair.get("confidence") or 0.0)
