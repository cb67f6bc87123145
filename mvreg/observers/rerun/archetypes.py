"""The Rerun archetypes of a recording: clouds, lines, scalars, and the blueprint.

Rerun takes half a second to import, so every function imports it for itself.
"""

from __future__ import annotations

import colorsys
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array, Indices, Pair, View

if TYPE_CHECKING:
    from rerun import RecordingStream

Color = tuple[int, int, int]
GREY: Color = (150, 150, 150)
BLUE: Color = (90, 140, 255)
GREEN: Color = (60, 200, 90)
RED: Color = (230, 60, 60)
YELLOW: Color = (240, 200, 60)
CYAN: Color = (60, 210, 220)
#: A recording is for eyes: more points or lines cost time and show nothing more.
MOST_POINTS = 5000
MOST_LINES = 200
#: Clouds of many scans are thinner, so that all of one kind have no more points than this, down to
#: so many each: the recording of some thousand scans takes some hundred megabytes.
ALL_POINTS, LEAST_POINTS = 1_500_000, 200


def most_points(scans: int) -> int:
    """How many points of a cloud are recorded in a run of so many scans."""
    return min(MOST_POINTS, max(LEAST_POINTS, ALL_POINTS // max(scans, 1)))


def hue(index: int) -> Color:
    """A colour per scan; steps of the golden ratio keep any number of them apart."""
    red, green, blue = colorsys.hsv_to_rgb(index * 0.618034 % 1.0, 0.65, 0.95)
    return round(255 * red), round(255 * green), round(255 * blue)


def escape(name: str) -> str:
    """A scan's name as one part of an entity path."""
    import rerun as rr

    return rr.escape_entity_path_part(name)


def cloud(view: View, color: Color, most: int = MOST_POINTS) -> Any:
    """Registration points of a view, thinned evenly to `most`."""
    import rerun as rr

    points = view.points[:: max(1, -(-len(view.points) // most))]
    return rr.Points3D(points.astype(np.float32), colors=[color], radii=[view.resolution / 3])


def pose(transform: Array | None) -> Any:
    """A rigid motion; None is the identity."""
    import rerun as rr

    matrix = np.eye(4) if transform is None else transform
    return rr.Transform3D(translation=matrix[:3, 3], mat3x3=matrix[:3, :3])


def beside(source: View, target: View) -> Array:
    """A shift of the source that puts it beside the target, so that lines can be seen."""
    low, high = _box(source)
    target_low, target_high = _box(target)
    shift = (target_low + target_high - low - high) / 2
    shift[0] = target_high[0] - low[0] + 0.3 * (target_high[0] - target_low[0])
    return se3.from_parts(np.eye(3), shift)


def matches(source: View, target: View, indices: Indices | None, color: Color) -> Any:
    """Lines from keypoints of the source, beside the target, to keypoints of the target."""
    import rerun as rr

    if indices is None or not len(indices):
        return nothing()
    few = indices[:: -(-len(indices) // MOST_LINES)]
    start = se3.apply(beside(source, target), source.features.keypoints[few[:, 0]])
    strips = np.stack([start, target.features.keypoints[few[:, 1]]], axis=1)
    return rr.LineStrips3D(strips.astype(np.float32), colors=[color])


def nothing() -> Any:
    """Takes away what an earlier pair left."""
    import rerun as rr

    return rr.Clear(recursive=False)


def scalar(value: float | None) -> Any:
    """One point of a curve; a gap where there is no finite value."""
    import rerun as rr

    return rr.Scalars([value if value is not None and math.isfinite(value) else math.nan])


def verdict(pair: Pair) -> Any:
    """A line of the log."""
    import rerun as rr

    given = pair.verdict
    word, level = ("accepted", "INFO") if given.reliable else ("rejected", "WARN")
    text = f"{word}: {pair.source} -> {pair.target}: {given.reason}"
    if pair.trimmed_mse is not None:
        text += f" (score {given.score:.4g}, threshold {given.threshold:.4g})"
    return rr.TextLog(text, level=level, color=[*(GREEN if given.reliable else RED)])


def open_recording(path: Path, name: str) -> RecordingStream:
    """A recording that goes to a file, laid out, with the time counted in pairs."""
    import rerun as rr

    stream = rr.RecordingStream("mvreg")
    stream.save(path, default_blueprint=blueprint())
    stream.send_recording_name(name)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    line, dot = rr.SeriesLines, rr.SeriesPoints
    stream.log("judge/score", line(colors=[BLUE], names=["score"]), static=True)
    stream.log("judge/threshold", line(colors=[GREY], names=["threshold"]), static=True)
    stream.log("judge/accepted", dot(colors=[GREEN], names=["accepted"]), static=True)
    stream.log("judge/rejected", dot(colors=[RED], names=["rejected"]), static=True)
    return stream


def blueprint() -> Any:
    """Model and pair side by side; below them the curves and the verdicts.

    Behind the model, in a tab, what the poses are worth.
    """
    import rerun.blueprint as rrb

    curves = rrb.Tabs(
        rrb.TimeSeriesView(origin="judge", name="score against threshold"),
        rrb.TimeSeriesView(origin="tmse", name="trimmed MSE"),
        rrb.TimeSeriesView(origin="overlap", name="overlap"),
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                rrb.Tabs(
                    rrb.Spatial3DView(origin="model", name="model"),
                    rrb.Spatial3DView(origin="confidence", name="confidence"),
                ),
                rrb.Spatial3DView(origin="pair", name="pair"),
            ),
            rrb.Horizontal(curves, rrb.TextLogView(origin="verdicts", name="verdicts")),
            row_shares=[2, 1],
        ),
        rrb.TimePanel(timeline="pair", expanded=False),
        collapse_panels=True,
    )


def _box(view: View) -> tuple[Array, Array]:
    if not len(view.points):
        return np.zeros(3), np.zeros(3)
    return view.points.min(axis=0), view.points.max(axis=0)
