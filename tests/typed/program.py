"""What a user of the library may write; checked by mypy --strict, and run with -W error."""

from __future__ import annotations

import sys
import time

import numpy as np
from numpy.typing import NDArray

import mvreg
from mvreg.types import PointLike


def clouds() -> dict[str, PointLike]:
    """Three scans, as different libraries and cameras might hand them over."""
    first, second, third = mvreg.dataset("tiny", views=3).scans
    single: NDArray[np.float32] = first.points.astype(np.float32)
    rows: list[list[float]] = second.points.tolist()
    return {"single": single, "rows": rows, "table": {a: third.points[:, k] for k, a in
                                                      enumerate("xyz")}}  # fmt: skip


def register(seconds: float) -> mvreg.Result | None:
    """Register them, within a time."""
    deadline = time.monotonic() + seconds

    def watch(now: mvreg.Progress) -> bool:
        print(f"{now.step}: {now.done} of {now.total}, {now.text}", file=sys.stderr)
        return time.monotonic() < deadline

    try:
        return mvreg.register(clouds(), changes={"seed.top_fraction": 0.5}, progress=watch)
    except mvreg.CancelledError as cancelled:
        return cancelled.result


def main() -> int:
    """Say where the scans are, and how sure that is."""
    scan = mvreg.Scan("one", np.zeros((4, 3), dtype=">f4"), view_point=(0.0, 0.0, 1.0))
    assert scan.points.dtype == np.float64
    result = register(60.0)
    if result is None:
        return 1
    assessment = mvreg.assess(result)
    for name, pose in result.poses.items():
        grade = assessment.scans[name].grade
        print(name, grade, np.round(pose[:3, 3], 1).tolist())
    try:
        mvreg.register([scan])
    except mvreg.InputError as error:
        print("refused:", error)
    return 0 if not result.unregistered else 3


if __name__ == "__main__":
    sys.exit(main())
