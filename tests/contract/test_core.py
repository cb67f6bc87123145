"""Every stage of the core under its kind's suite; a new stage without one fails."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mvreg.contracts import KINDS
from mvreg.datasets.environments.sets import Desk, Office, Room, Street, Yard
from mvreg.datasets.folder import Folder
from mvreg.datasets.mixture import Mixture
from mvreg.datasets.spoilt import Spoilt
from mvreg.datasets.stanford import Stanford
from mvreg.datasets.synthetic import Figurine, Tiny
from mvreg.geometry import se3
from mvreg.io import write_ply
from mvreg.plugins import manager
from mvreg.stages.describe.spectrum import EigenvaluesDescribe
from mvreg.testing import SUITES
from mvreg.testing.views import SMALL

CORE = {key: stage for key, stage in manager.stages().items() if stage.plugin == "mvreg"}

SPHERE = "tiny views=2 points=300 shape=sphere"
#: Stages whose defaults are not what the suites' small scans ask for, or that need something.
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
    "describe/eigenvalues": EigenvaluesDescribe(stride=1),
}
#: What a stage may do otherwise, and why.
WAIVED: dict[str, dict[str, Any]] = {
    "downsample/paper": {"ignores_point_order": False},  # a stride
    "downsample/stride": {"ignores_point_order": False},
    "describe/none": {"describes": False},
    "refine/icp": {"partial_overlap": False},  # that is what TrICP is for
}


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three scans and their poses, as Stanford lays them out."""
    path = tmp_path_factory.mktemp("scans")
    rng = np.random.default_rng(0)
    lines = []
    for index in range(3):
        write_ply(path / f"s{index}.ply", rng.normal(size=(30, 3)))
        quaternion = rng.normal(size=4)
        numbers = [*rng.normal(size=3), *(quaternion / np.linalg.norm(quaternion))]
        lines.append(f"bmesh s{index}.ply " + " ".join(map(str, numbers)))
    (path / "truth.conf").write_text("\n".join(lines) + "\n")
    return path


def suite(key: str) -> type:
    """A test class for one registered stage."""
    stage = CORE[key]
    if key in ("dataset/folder", "dataset/stanford"):

        @pytest.fixture(autouse=True)
        def made(self: Any, folder: Path) -> Iterator[None]:
            self.stage = (
                Folder(path=str(folder), ground_truth="truth.conf")
                if key == "dataset/folder"
                else Stanford(root=str(folder), conf="truth.conf", name="toy", url="https://example.org/toy.zip",
                              files=[f"s{i}.ply" for i in range(3)])
            )  # fmt: skip
            yield

        contents: dict[str, Any] = {"made": made}
    else:
        contents = {"stage": INSTEAD.get(key) or stage.cls()}
    name = "Test" + "".join(word.title() for word in key.replace("/", "_").split("_"))
    return type(name, (SUITES[stage.kind],), {**contents, **WAIVED.get(key, {})})


for _key in CORE:
    _suite = suite(_key)
    globals()[_suite.__name__] = _suite


def test_every_kind_has_a_suite() -> None:
    assert set(SUITES) == set(KINDS)


def test_every_stage_of_the_core_has_a_suite() -> None:
    tested = {name for name in globals() if name.startswith("Test")}
    assert len(tested) == len(CORE)
    assert set(INSTEAD) | set(WAIVED) <= set(CORE), "an exception for a stage that is gone"


def test_the_suites_scans_have_exact_poses() -> None:
    """What the suites call right is right: neighbours lie on each other's surface."""
    from mvreg.testing import overlap

    pair = overlap()
    there = se3.apply(pair.T_target_source, pair.source.points)
    distances, nearest = pair.target.tree.query(there)
    close = distances < pair.target.resolution
    assert close.mean() > 0.5
    gaps = (there - pair.target.points[nearest]) * pair.target.normals[nearest]
    assert np.sqrt((gaps.sum(axis=1)[close] ** 2).mean()) < 0.2 * pair.target.resolution
