"""Support for testing stages: a contract suite per kind, and synthetic scans.

A plugin's test file needs two lines, and pytest:

    from mvreg.testing import SeedContract

    class TestMySeed(SeedContract):
        stage = MySeed()

What the suites check is the part of the contract that types cannot say: that stages are pure and
silent, that the same random numbers give the same answer, that neither the frame, nor the unit of
length, nor the order of the points matters, that a scan finds itself, and that degenerate input
gives an empty or an honest answer, not an exception and not NaN.
"""

from pkgutil import iter_modules

import pytest

# Before they are imported, so that a failed assertion shows its values.
pytest.register_assert_rewrite(*(f"{__name__}.{part.name}" for part in iter_modules(__path__)))

from mvreg.testing.adjust import AdjustContract  # noqa: E402
from mvreg.testing.augment import AugmentContract  # noqa: E402
from mvreg.testing.base import StageContract  # noqa: E402
from mvreg.testing.dataset import DatasetContract  # noqa: E402
from mvreg.testing.describe import DescribeContract  # noqa: E402
from mvreg.testing.downsample import DownsampleContract  # noqa: E402
from mvreg.testing.judge import JudgeContract  # noqa: E402
from mvreg.testing.propagate import PropagateContract  # noqa: E402
from mvreg.testing.refine import RefineContract  # noqa: E402
from mvreg.testing.scans import blob_scan, blob_scans, plane_scans  # noqa: E402
from mvreg.testing.seed import SeedContract  # noqa: E402
from mvreg.testing.strategy import StrategyContract  # noqa: E402
from mvreg.testing.views import blob_views, overlap, pipeline  # noqa: E402

#: The suite of each kind of stage.
SUITES: dict[str, type[StageContract]] = {
    suite.kind: suite
    for suite in (
        DatasetContract, DownsampleContract, DescribeContract, SeedContract, PropagateContract,
        RefineContract, JudgeContract, AugmentContract, StrategyContract, AdjustContract,
    )
}  # fmt: skip

__all__ = [
    "SUITES",
    "AdjustContract",
    "AugmentContract",
    "DatasetContract",
    "DescribeContract",
    "DownsampleContract",
    "JudgeContract",
    "PropagateContract",
    "RefineContract",
    "SeedContract",
    "StageContract",
    "StrategyContract",
    "blob_scan",
    "blob_scans",
    "blob_views",
    "overlap",
    "pipeline",
    "plane_scans",
]
