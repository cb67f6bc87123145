"""Every stage of the core under its kind's suite; a new stage without one fails."""

import numpy as np

from mvreg.contracts import KINDS
from mvreg.geometry import se3
from mvreg.plugins import manager
from mvreg.testing import SUITES
from mvreg.testing.core import core_suites

CORE = {key: stage for key, stage in manager.stages().items() if stage.plugin == "mvreg"}


def suite(key: str) -> type:
    """A test class for one registered stage."""
    stage = CORE[key]
    name = "Test" + "".join(word.title() for word in key.replace("/", "_").split("_"))
    special = core_suites().get(key)
    if special is not None:
        return type(name, (special,), {})
    return type(name, (SUITES[stage.kind],), {"stage": stage.cls()})


for _key in CORE:
    _suite = suite(_key)
    globals()[_suite.__name__] = _suite


def test_every_kind_has_a_suite() -> None:
    assert set(SUITES) == set(KINDS)


def test_every_stage_of_the_core_has_a_suite() -> None:
    tested = {name for name in globals() if name.startswith("Test")}
    assert len(tested) == len(CORE)
    assert set(core_suites()) <= set(CORE), "an exception for a stage that is gone"


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
