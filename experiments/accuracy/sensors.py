"""How well the position of a sensor is told by the density of the points alone.

    python -m experiments.accuracy.sensors room office street yard desk rgbd_desk tls_office

Hides what every scan of the data sets says of its sensor and estimates it. Lists for each set how
many scans were given a position, a direction or nothing, the errors, and the quantities that
`mvreg.surface.sensor.estimated_sensor` decides by. Data sets that say nothing of their sensors are
taken to have them at the origin (`dataset.sensor=origin`), which is right for the recorded ones.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

import mvreg
from mvreg.surface.sensor import estimated_sensor, told_sensor
from mvreg.surface.sensor_position import hidden_from, positions, residuals, sampled, spread
from mvreg.types import Array, Scan


def decided_by(scan: Scan) -> tuple[float, float, float, float]:
    """The spread of log densities that a position leaves, and its share of what there was.

    And how many times as much the mirrored position leaves, and the share of points that it hides.
    """
    own = sampled(scan)
    if own is None:
        return (np.nan,) * 4
    point, left = positions(own)[0]
    mirrored = 2 * own.points.mean(axis=0) - point
    gain = float(spread(residuals(mirrored, own))) / max(left, 1e-9)
    return left, left / float(spread(own.density)), gain, hidden_from(scan.points, point)


def error(scan: Scan, silent: Scan) -> tuple[str, float]:
    """What is told, and its error: degrees of a direction, per cent of the scan's size of a point.

    Of a direction the error is the angle to the true one from the middle of the scan.
    """
    true, found = told_sensor(scan), estimated_sensor(silent)
    assert true is not None
    if found is None:
        return "nothing", np.nan
    if found.point is not None and true.point is not None:
        size = float(np.linalg.norm(np.ptp(scan.points, axis=0)))
        return "position", 100 * float(np.linalg.norm(found.point - true.point)) / size
    middle = scan.points.mean(axis=0)[None]
    cosine = float((true.towards(middle) * found.towards(middle)).sum())
    return "direction", float(np.rad2deg(np.arccos(np.clip(cosine, -1, 1))))


def quantiles(values: Array) -> str:
    """Median and largest of the numbers."""
    known = values[np.isfinite(values)]
    return f"{np.median(known):.3g}, {known.max():.3g}" if len(known) else "-"


def main() -> None:
    """Print a row for each data set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("datasets", nargs="+")
    asked = parser.parse_args()
    heads = (
        "set", "scans", "positions", "error (%)", "directions", "error (deg)", "nothing",
        "spread left", "share left", "mirrored, least", "hidden",
    )  # fmt: skip
    table = Table(*heads, title="medians and largest")
    for name in asked.datasets:
        scans = mvreg.dataset(name).scans
        if not all(scan.knows_sensor for scan in scans):
            scans = mvreg.dataset(name, sensor="origin").scans
        silent = [replace(scan, view_point=None, view_direction=None) for scan in scans]
        told = [error(*both) for both in zip(scans, silent, strict=True)]
        by = np.array([decided_by(scan) for scan in silent])
        kinds = [kind for kind, _ in told]
        errors = {
            kind: np.array([value for own, value in told if own == kind]) for kind in set(kinds)
        }
        table.add_row(
            name, str(len(scans)), str(kinds.count("position")),
            quantiles(errors.get("position", np.array([]))), str(kinds.count("direction")),
            quantiles(errors.get("direction", np.array([]))), str(kinds.count("nothing")),
            quantiles(by[:, 0]), quantiles(by[:, 1]), f"{np.nanmin(by[:, 2]):.3g}",
            quantiles(by[:, 3]),
        )  # fmt: skip
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
