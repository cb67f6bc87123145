"""Support for testing stages: a contract suite per kind, and synthetic scans.

A plugin's test file needs two lines, and pytest:

    from mvreg.testing import SeedContract

    class TestMySeed(SeedContract):
        stage = MySeed()

Outside of pytest, ``mvreg plugins check`` runs them on whatever is installed.

What the suites check is the part of the contract that types cannot say: that stages are pure and
silent, that the same random numbers give the same answer, that neither the frame, nor the unit of
length, nor the order of the points matters, that a scan finds itself, and that degenerate input
gives an empty or an honest answer, not an exception and not NaN.
"""

from mvreg.testing.adjust import AdjustContract
from mvreg.testing.augment import AugmentContract
from mvreg.testing.base import StageContract
from mvreg.testing.core import SUITES
from mvreg.testing.dataset import DatasetContract
from mvreg.testing.describe import DescribeContract
from mvreg.testing.downsample import DownsampleContract
from mvreg.testing.export import ExportContract
from mvreg.testing.judge import JudgeContract
from mvreg.testing.propagate import PropagateContract
from mvreg.testing.reader import ReaderContract
from mvreg.testing.refine import RefineContract
from mvreg.testing.scans import blob_scan, blob_scans, plane_scans
from mvreg.testing.seed import SeedContract
from mvreg.testing.strategy import StrategyContract
from mvreg.testing.views import blob_views, overlap, pipeline

__all__ = [
    "SUITES",
    "AdjustContract",
    "AugmentContract",
    "DatasetContract",
    "DescribeContract",
    "DownsampleContract",
    "ExportContract",
    "JudgeContract",
    "PropagateContract",
    "ReaderContract",
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
