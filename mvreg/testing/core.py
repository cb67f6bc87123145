"""The suites of mvreg's own stages, where their defaults are not what the small scans ask for."""

from __future__ import annotations

import tempfile
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.datasets.environments.sets import Desk, Office, Room, Street, Yard
from mvreg.datasets.folder import Folder
from mvreg.datasets.mixture import Mixture
from mvreg.datasets.spoilt import Spoilt
from mvreg.datasets.stanford import Stanford
from mvreg.datasets.synthetic import Figurine, Tiny
from mvreg.io import write_ply
from mvreg.stages.describe.spectrum import EigenvaluesDescribe, NoDescribe
from mvreg.stages.downsample.sampling import StrideDownsample
from mvreg.stages.refine.trimmed import ICP
from mvreg.testing.adjust import AdjustContract
from mvreg.testing.augment import AugmentContract
from mvreg.testing.base import StageContract
from mvreg.testing.dataset import DatasetContract
from mvreg.testing.describe import DescribeContract
from mvreg.testing.downsample import DownsampleContract
from mvreg.testing.judge import JudgeContract
from mvreg.testing.propagate import PropagateContract
from mvreg.testing.refine import RefineContract
from mvreg.testing.seed import SeedContract
from mvreg.testing.strategy import StrategyContract
from mvreg.testing.views import SMALL

__all__ = ["SUITES", "core_suites"]

#: The suite of each kind of stage.
SUITES: dict[str, type[StageContract]] = {
    suite.kind: suite
    for suite in (
        DatasetContract, DownsampleContract, DescribeContract, SeedContract, PropagateContract,
        RefineContract, JudgeContract, AugmentContract, StrategyContract, AdjustContract,
    )
}  # fmt: skip

SPHERE = "tiny views=2 points=300 shape=sphere"
#: Stages whose defaults are not what the suites' small scans ask for, or that do not keep to all.
INSTEAD: dict[str, Any] = {
    "dataset/figurine": Figurine(views=2, points=300, shape="sphere"),
    "dataset/tiny": Tiny(views=2, points=300, shape="sphere"),
    **{
        f"dataset/{cls.__name__.lower()}": cls(scans=2, rays=600)
        for cls in (Room, Office, Yard, Street, Desk)
    },
    "dataset/mixture": Mixture(
        of=[SPHERE, SPHERE.replace("sphere", "box")], keep=["2"], scramble=False
    ),
    "dataset/spoilt": Spoilt(of=SPHERE, noise=0.1, outliers=0.1, drop=0.1, sparse=1),
    "downsample/paper": SMALL,
    "downsample/stride": StrideDownsample(),
    "describe/eigenvalues": EigenvaluesDescribe(stride=1),
    "describe/none": NoDescribe(),
    "refine/icp": ICP(),
}
#: What one of these may do otherwise, and why.
WAIVED: dict[str, dict[str, Any]] = {
    "downsample/paper": {"ignores_point_order": False},  # a stride
    "downsample/stride": {"ignores_point_order": False},
    "describe/none": {"describes": False},
    "refine/icp": {"partial_overlap": False},  # that is what TrICP is for
}


@cache
def _folder() -> tuple[Path, tempfile.TemporaryDirectory[str]]:
    """Three scans and their poses, as Stanford lays them out; gone when the process ends."""
    holder = tempfile.TemporaryDirectory(prefix="mvreg-suite-", ignore_cleanup_errors=True)
    path = Path(holder.name)
    rng = np.random.default_rng(0)
    lines = []
    for index in range(3):
        write_ply(path / f"s{index}.ply", rng.normal(size=(30, 3)))
        quaternion = rng.normal(size=4)
        numbers = [*rng.normal(size=3), *(quaternion / np.linalg.norm(quaternion))]
        lines.append(f"bmesh s{index}.ply " + " ".join(map(str, numbers)))
    (path / "truth.conf").write_text("\n".join(lines) + "\n")
    return path, holder


class FolderSuite(DatasetContract):
    """The suite of ``dataset=folder``, which needs one."""

    @cached_property
    def stage(self) -> Any:  # type: ignore[override]
        """A folder with a file of poses."""
        return Folder(path=str(_folder()[0]), ground_truth="truth.conf")


class StanfordSuite(DatasetContract):
    """The suite of ``dataset=stanford``, without a download."""

    @cached_property
    def stage(self) -> Any:  # type: ignore[override]
        """The same folder, as one of the Stanford repository."""
        files = [f"s{i}.ply" for i in range(3)]
        url = "https://example.org/toy.zip"
        root = str(_folder()[0])
        return Stanford(root=root, conf="truth.conf", name="toy", url=url, files=files)


def core_suites() -> dict[str, type]:
    """Suites by the keys of stages whose defaults would not do."""
    made: dict[str, type] = {"dataset/folder": FolderSuite, "dataset/stanford": StanfordSuite}
    for key, stage in INSTEAD.items():
        name = "".join(word.title() for word in key.replace("/", "_").split("_")) + "Suite"
        contents = {"stage": stage, **WAIVED.get(key, {})}
        made[key] = type(name, (SUITES[key.partition("/")[0]],), contents)
    return made
