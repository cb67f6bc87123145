"""What the evidence says of the poses of `evidence_poses`, kept in files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.progress import track

from experiments.calibration.poses import Pose, cached, with_truth
from experiments.calibration.scenes import scene
from mvreg.evidence.calibration import features
from mvreg.evidence.pooled import ViewPair, pool_evidence
from mvreg.report.upgrade import EVIDENCE, renamed
from mvreg.types import Array

#: Groups that are searched a second time, with the sensors hidden: as many as time allows.
SEARCHED_BLIND = (
    "bunny", "dragon", "figurine", "bunny+dragon", "room-0", "room-2", "office-0", "tls_office",
    "street-0", "lidar_campus", "desk-0", "rgbd_desk", "office-0+room-0",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One pose, whether it is right, and what is measured of it; see `mvreg.evidence.Evidence`."""

    source: str
    target: str
    kind: str
    right: bool
    true_overlap: float
    angle: float | None
    shift: float | None
    surface_overlap: float
    residual: float
    noise: float
    agreement: float
    violation: float | None
    sensor: str
    localizability: float
    residual_step: float
    points: int

    @property
    def features(self) -> Array:
        """What the probability is made of."""
        return features(
            self.surface_overlap,
            self.residual,
            self.noise,
            self.agreement,
            self.violation,
            self.residual_step,
        )


def measure(group: str, sensor: str, folder: Path) -> list[Row]:
    """Weigh all poses of a group; with the sensors hidden, those found without them as well."""
    poses: list[Pose] = list(cached(group, blind=False, folder=folder / "poses"))
    if sensor != "known" and group in SEARCHED_BLIND:
        poses += cached(group, blind=True, folder=folder / "poses")
    found = scene(group, sensor)
    rows = []
    for pose in track(with_truth(found, poses), description=f"weigh {group}"):
        evidence = pool_evidence(
            [ViewPair(found.views[pose.source], found.views[pose.target], pose.matrix)]
        )
        rows.append(
            Row(
                pose.source, pose.target, pose.kind, pose.right, pose.true_overlap, pose.angle,
                pose.shift, **asdict(evidence),
            )
        )  # fmt: skip
    return rows


def rows_of(group: str, sensor: str, folder: Path) -> Sequence[Row]:
    """The rows of a group, from their file where it is, else measured now."""
    file = folder / "rows" / f"{group}-{sensor}.json"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(".part")
        rows = [asdict(row) for row in measure(group, sensor, folder)]
        unfinished.write_text(json.dumps({"rows": rows}, allow_nan=False), "utf-8")
        unfinished.replace(file)
    kept = json.loads(file.read_text("utf-8"))["rows"]
    return [Row(**renamed(row, EVIDENCE)) for row in kept]
