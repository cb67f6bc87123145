"""Hashes of content: alike for what is alike, different for anything else."""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import pytest

from mvreg.run import load_method
from mvreg.store.content import UnknownContentError, digest, stage_digest
from mvreg.testing import blob_views
from mvreg.types import Scan


class Colour(Enum):
    RED = 1
    BLUE = 2


@dataclass(frozen=True)
class Part:
    size: float
    note: str = field(default="", metadata={"stored": False})


@dataclass(frozen=True)
class OtherPart:
    size: float


def test_equal_content_has_one_hash():
    points = np.arange(12.0).reshape(4, 3)
    assert digest(points, "a", 1) == digest(points.copy(), "a", np.int64(1))
    assert digest(points.T) == digest(np.ascontiguousarray(points.T)), "the layout does not count"
    assert digest(Part(1.0, "x")) == digest(Part(1.0, "y")), "a field that is not stored"
    assert digest({"a": 1.0}) == digest({"a": 1.0})


DIFFERENT = [
    None, True, 1, 1.0, "1", "", (), (1,), [1, 1], ("1",), {"a": 1}, {"b": 1}, Colour.RED,
    Colour.BLUE, Part(1.0), Part(2.0), OtherPart(1.0), 0.0, -0.0, float("nan"), float("inf"),
    np.zeros(3), np.zeros((1, 3)), np.zeros(3, np.float32), np.zeros(0), np.nextafter(1.0, 2.0),
    ("ab", "c"), ("a", "bc"), (("a",), "b"), ("a", ("b",)),
]  # fmt: skip


def test_different_content_has_different_hashes():
    found = [digest(one) for one in DIFFERENT]
    assert len(set(found)) == len(found)


def test_what_has_no_content_is_refused():
    for nothing in (lambda: 1, object(), Part, np.array([object()])):
        with pytest.raises(UnknownContentError):
            digest(nothing)


def test_a_view_counts_to_the_last_bit():
    view = blob_views()[0]
    moved = view.points.copy()
    moved[7, 1] = np.nextafter(moved[7, 1], np.inf)
    assert digest(replace(view, points=moved)) != digest(view)
    assert digest(replace(view, name="other")) != digest(view)
    assert digest(replace(view)) == digest(view)


def test_attributes_of_a_scan_do_not_count():
    points = np.random.default_rng(0).random((5, 3))
    assert digest(Scan("a", points, attributes={"red": np.ones(5)})) == digest(Scan("a", points))
    assert digest(Scan("a", points, view_point=np.ones(3))) != digest(Scan("a", points))


def test_a_stage_counts_by_its_class_and_parameters():
    judge = load_method("auto").pipeline.judge
    checked = load_method("auto").pipeline.checked().judge
    assert stage_digest(checked) == stage_digest(judge), "a checked stage is the same stage"
    assert stage_digest(replace(judge, min_probability=0.9)) != stage_digest(judge)
