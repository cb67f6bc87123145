"""Stages of every kind put into the default method, alone and in pairs, on the smallest scans."""

from functools import cache

import mvreg
from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.evaluation.pose_errors import pose_errors
from mvreg.plugins import manager
from mvreg.types import Result, ScanSet

#: Degrees and mm of the worst scan that is placed; the default's are 0.07 and 0.08, and those of
#: the mixture model of `adjust=jrmpc`, the least exact adjustment, 0.39 and 1.1; Open3D's pose
#: graph, not adjusted, 1.5 and 2.7, and plain ICP, 2.4 and 2.5. Neighbours are 30 degrees apart.
MAX_ANGLE, MAX_SHIFT = 3.0, 3.0

#: Stages with which scans of `tiny` are left over, and why. None may place one wrongly.
EXCEPTIONS = {
    "describe/none": "matches nothing by design",
    "refine/icp": "pairs every point, which pulls scans that overlap in part over each other: nine "
    "of the first twelve attempts are refused, for surfaces where a sensor saw free space",
    "strategy/kiss_gicp": "at KISS-Matcher's published defaults a scan of `tiny` has some 600 "
    "voxels: 14 of 15 pairs have 0 to 4 inliers, where its examples ask for 5; with voxels of 2 "
    "resolutions three scans are placed",
}

STAGES = [
    key for key, stage in manager.stages().items()
    if stage.kind in KINDS and stage.kind != "dataset"
]  # fmt: skip


@cache
def tiny() -> ScanSet:
    """The scans that are registered."""
    return mvreg.dataset("tiny")


@cache
def default() -> frozenset[str]:
    """The stages that the default method consists of."""
    method = mvreg.load_method("auto")
    parts = [*vars(method.pipeline).values(), method.strategy, method.adjust]
    classes = {type(part) for part in parts}
    return frozenset(key for key in STAGES if manager.stages()[key].cls in classes)


def kind_of(key: str) -> str:
    """The kind of stage in ``kind/name``."""
    return key.partition("/")[0]


def pairs() -> list[tuple[str, str]]:
    """All pairs of stages of different kinds that the default method does not have."""
    others = [key for key in STAGES if key not in default()]
    return [
        (first, second)
        for number, first in enumerate(others)
        for second in others[number + 1 :]
        if kind_of(first) != kind_of(second)
    ]


def covering(all_pairs: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Some of the pairs, in which every stage that has a partner is at least once."""
    met: set[str] = set()
    chosen = []
    for fresh in (2, 1):  # two that have not been met, as long as there are such pairs
        for pair in all_pairs:
            if len(set(pair) - met) >= fresh:
                chosen.append(pair)
                met.update(pair)
    return chosen


def registered(*keys: str) -> Result | None:
    """What the default method makes of `tiny` with these stages; None where they are refused.

    Fails where a scan is placed wrongly, in any of the partial models.
    """
    try:
        method = mvreg.load_method("auto", dict(key.split("/") for key in keys))
    except InputError as refusal:
        assert any(kind_of(key) in str(refusal) for key in keys)
        return None
    result = mvreg.register(tiny(), method)
    for poses in (result.poses, *result.components):
        errors = pose_errors(poses, tiny().poses, next(iter(poses)))
        if errors is not None:
            assert errors.max.angle < MAX_ANGLE
            assert errors.max.translation < MAX_SHIFT
    return result


def is_complete(result: Result) -> bool:
    """Whether all scans are in one model."""
    return len(result.poses) == len(tiny().scans)
