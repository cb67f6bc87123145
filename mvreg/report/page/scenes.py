"""What the view in three dimensions can show: partial models, files as they are, refused poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mvreg.geometry import se3
from mvreg.report.page import words
from mvreg.report.page.pairs import most_telling
from mvreg.types import Array, Scan, ScanSet

Row = dict[str, Any]
#: Attempts shown of a scan that was not placed.
HYPOTHESES = 3
#: A sensor is a camera if this much of the way to the middle of its points, or more, is along z.
ALONG = 0.9
#: Points of a scan that tell how far it reaches.
FEW = 200


def models_of(report: Mapping[str, Any]) -> list[dict[str, Array]]:
    """The poses (4, 4) by scan, of the reference's model, then of the other components."""
    parts = [report.get("poses") or {}, *(p["poses"] for p in report.get("components") or [])]
    return [
        {name: np.asarray(pose, dtype=np.float64) for name, pose in part.items()} for part in parts
    ]


def scenes(
    report: Mapping[str, Any], models: Sequence[Mapping[str, Array]], rows: Sequence[Row]
) -> tuple[list[Row], list[Row]]:
    """What the view can show; and the scans not placed with their attempts.

    Parameters
    ----------
    report : mapping
        As in ``result.json``.
    models : sequence of mapping of scan name to (4, 4) array
        See `models_of`.
    rows : sequence of dict
        The scans of the report, in the order of the page.
    """
    found = [
        {"title": _title(number, poses), "items": [_item(*named) for named in poses.items()]}
        for number, poses in enumerate(models, start=1)
    ]  # fmt: skip
    found.append({
        "title": "before: as the files have them",
        "items": [_item(str(row["name"]), np.eye(4)) for row in rows],
    })  # fmt: skip
    lost = []
    for row in rows:
        if row.get("status") not in words.LOST or report.get("status") == "running":
            continue
        best = hypotheses(str(row["name"]), report)
        lost.append({
            "name": str(row["name"]), "doubt": words.doubt(row), "status": row.get("status"),
            "attempts": [pair | {"scene": len(found) + k} for k, pair in enumerate(best)],
        })  # fmt: skip
        found += [_hypothesis(pair) for pair in best]
    return found, lost


def _title(number: int, poses: Mapping[str, Array]) -> str:
    if len(poses) == 1:
        return f"{next(iter(poses))}, alone"
    return "the model" if number == 1 else f"component {number}"


def hypotheses(name: str, report: Mapping[str, Any]) -> list[Row]:
    """The best attempts at a scan that found a pose, of each other scan one, the best first.

    One that leaves several answers is there with each of them, as `answer` of so many, `answers`.
    """
    best = most_telling(
        pair for pair in report.get("pairs") or []
        if name in (pair["source"], pair["target"]) and pair.get("T_target_source")
    )[:HYPOTHESES]  # fmt: skip
    return [each for pair in best for each in _answered(pair)]


def _answered(pair: Row) -> list[Row]:
    """An attempt, or each of the answers that it leaves."""
    answers = pair.get("answers") or []
    if not answers:
        return [pair | {"answer": 1, "answers": 1}]
    return [
        pair | {
            "answer": number, "answers": len(answers), "confidence": one["confidence"],
            "T_target_source": one["T_target_source"],
        }
        for number, one in enumerate(answers, start=1)
    ]  # fmt: skip


def _hypothesis(pair: Row) -> Row:
    word = "withdrawn" if pair["verdict"] == "accepted" else "refused"
    if pair["answers"] > 1:
        word = f"answer {pair['answer']} of {pair['answers']}"
    return {
        "title": f"{pair['source']} on {pair['target']}, {word}",
        "items": [
            _item(pair["target"], np.eye(4)),
            _item(pair["source"], np.asarray(pair["T_target_source"], dtype=np.float64)),
        ],
    }


def _item(name: str, pose: Array) -> Row:
    return {"scan": name, "pose": flat(pose)}


def flat(pose: Array) -> list[float]:
    """A pose row by row."""
    return [float(value) for value in pose.reshape(-1)]


def upright(scanset: ScanSet, report: Mapping[str, Any], poses: Mapping[str, Array]) -> Array:
    """The rotation (4, 4) that turns the model's vertical to +z, and -y towards the viewer.

    The vertical is that of a levelled scan; where there is none, the viewer is where the sensor of
    the reference was. Of a camera +y is up then, if it looks along -z, and -y if along +z; where
    nothing is known, +z is, and the viewer looks across the longest side.
    """
    scans = [scan for scan in scanset.scans if scan.name in poses]
    levelled = next((scan for scan in scans if scan.up is not None), None)
    first = next((scan for scan in scans if scan.name == report.get("reference")), None)
    towards = _towards_camera(first) if first is not None else None
    if levelled is not None and levelled.up is not None:
        up = poses[levelled.name][:3, :3] @ levelled.up
        front = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    elif first is not None and towards is not None:
        front = poses[first.name][:3, :3] @ towards
        up = poses[first.name][:3, :3] @ np.array([0.0, np.sign(towards[2]), 0.0])
        up = up - (up @ front) * front
    else:
        up, front = np.array([0.0, 0.0, 1.0]), _shallow([(one, poses[one.name]) for one in scans])
    up, front = up / np.linalg.norm(up), front / np.linalg.norm(front)
    found = np.eye(4)
    found[:3, :3] = np.stack([np.cross(up, front), -front, up])
    return found


def _shallow(placed: Sequence[tuple[Scan, Array]]) -> Array:
    """The horizontal direction (3,) in which scans at their poses reach least, from the front."""
    if not placed:
        return np.array([0.0, -1.0, 0.0])
    some = [se3.apply(pose, scan.points[:: len(scan.points) // FEW + 1]) for scan, pose in placed]
    x, y = np.linalg.eigh(np.cov(np.concatenate(some)[:, :2].T))[1][:, 0]
    return np.array([x, y, 0.0]) * (-1.0 if y > 0 else 1.0)


def _towards_camera(scan: Scan) -> Array | None:
    """The direction (3,) of the sensor, if it looked at the points along its z; else None."""
    towards = scan.view_direction
    if towards is None and scan.view_point is not None:
        towards = scan.view_point - scan.points.mean(axis=0)
    length = 0.0 if towards is None else float(np.linalg.norm(towards))
    if towards is None or not length > 0 or abs(towards[2]) < ALONG * length:
        return None
    return towards / length
