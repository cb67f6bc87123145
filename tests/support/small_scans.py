"""Small scans that the methods register in about a second, and what they need to."""

from pathlib import Path

import numpy as np

from mvreg.io import write_ply
from mvreg.testing import blob_scans
from mvreg.testing.compare import apart
from mvreg.types import Array, Result, Scan, ScanSet

#: As `mvreg.testing.views.SMALL`: as few points as will do, to be quick.
CHANGES = {
    "downsample.stride": 2,
    "downsample.keypoint_ratio": 12,
    "downsample.min_points": 1,
    "downsample.min_keypoints": 1,
}
OVERRIDES = [f"{key}={value}" for key, value in CHANGES.items()]


def write_folder(folder: Path, scans: ScanSet, poor: bool = False) -> Path:
    """The scans as PLY files; if asked, with one of three points, forty times each."""
    folder.mkdir(parents=True, exist_ok=True)
    for scan in scans.scans:
        write_ply(folder / f"{scan.name}.ply", scan.points)
    if poor:
        write_ply(folder / "poor.ply", np.tile(np.eye(3), (40, 1)))
    return folder


def placed_like(result: Result, scans: ScanSet, truth: dict[str, Array]) -> float:
    """How far the worst point of a placed scan is from where the truth has it, in length."""
    first = np.linalg.inv(truth[result.reference])
    return max(
        apart(pose, first @ truth[scan.name], scan.points)
        for scan in scans.scans
        if (pose := result.poses.get(scan.name)) is not None
    )


def three() -> ScanSet:
    return blob_scans(3)


def poor_scans() -> list[Scan]:
    from mvreg.testing.scans import degenerate_points

    return [Scan(name, points) for name, points in degenerate_points().items()]
