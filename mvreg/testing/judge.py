"""The contract of `judge`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.stages.refine.trimmed import TrimmedICP
from mvreg.testing.base import StageContract
from mvreg.testing.compare import case
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    degenerate_pairs,
    graph_of,
    moved_view,
    overlap,
    registration,
    scaled_pose,
    scaled_registration,
    scaled_view,
)
from mvreg.testing.words import close, equal, expect, is_a
from mvreg.types import Edge, Registration, Verdict, View, ViewGraph


@cache
def right() -> Registration:
    """The two overlapping views, correctly registered."""
    pair = overlap()
    return TrimmedICP()(pair.source, pair.target, pair.T_target_source)


@cache
def wrong(degrees: float = 150.0) -> Registration:
    """The same two views with the source rotated about its centroid, registered from there."""
    pair = overlap()
    centre = pair.source.points.mean(axis=0)
    half = np.deg2rad(degrees) / 2
    turn = se3.rotation_from_quaternion(np.array([np.sin(half), 0, 0, np.cos(half)]))
    turned = se3.from_parts(turn, centre - turn @ centre)
    found = TrimmedICP()(pair.source, pair.target, pair.T_target_source @ turned)
    off = se3.rotation_angle(found.T_target_source, pair.T_target_source)
    expect(
        np.rad2deg(off) > 20,
        "the suite's own wrong pose to be wrong",
        f"{np.rad2deg(off):.3g} degrees",
    )
    return found


def scaled_edge(edge: Edge, unit: float) -> Edge:
    """The same edge in another unit of length."""
    pose = scaled_pose(edge.T_target_source, unit)
    return replace(edge, T_target_source=pose, trimmed_mse=edge.trimmed_mse * unit**2)


def told(verdict: Verdict) -> str:
    """A verdict in words."""
    score = f"score {verdict.score:.3g}, threshold {verdict.threshold:.3g}"
    return f"{verdict.reason!r}, {score}"


class JudgeContract(StageContract):
    """Correct registrations are accepted and wrong ones are not, in every frame and unit."""

    stage: contracts.Judge
    kind = "judge"

    def examples(self) -> dict[str, tuple[Any, ...]]:
        pair = overlap()
        return {
            "right, the first": (right(), pair.source, pair.target, ViewGraph()),
            "right, a later one": (right(), pair.source, pair.target, graph_of(right(), right())),
            "wrong, the first": (wrong(), pair.source, pair.target, ViewGraph()),
            "wrong, a later one": (wrong(), pair.source, pair.target, graph_of(right())),
        }

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        cases: dict[str, tuple[Any, ...]] = {}
        for name, (source, target) in degenerate_pairs().items():
            found = registration(source, target, np.eye(4))
            cases[name] = (found, source, target, ViewGraph())
            cases[f"{name}, later"] = (found, source, target, graph_of(found, right()))
        return cases

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        is_a("the answer", answer, Verdict)
        is_a("Verdict.reliable", answer.reliable, bool)
        is_a("Verdict.score", answer.score, float)
        is_a("Verdict.threshold", answer.threshold, float)
        expect(
            not np.isnan([answer.score, answer.threshold]).any(),
            "a score and a threshold that are numbers",
            f"{answer.score} and {answer.threshold}",
        )
        expect(answer.reason.strip(), "a verdict that gives its reason", "none")

    def test_right_is_accepted(self) -> None:
        for name, arguments in self.examples().items():
            if name.startswith("right"):
                with case(name):
                    verdict = self.call(*arguments)
                    expect(
                        verdict.reliable,
                        "a right registration to be relied on",
                        told(verdict),
                    )

    def test_wrong_is_not_accepted(self) -> None:
        pair = overlap()
        for degrees in (90.0, 150.0, 180.0):
            for graph in (ViewGraph(), graph_of(right(), right())):
                with case(f"turned by {degrees} degrees"):
                    verdict = self.call(wrong(degrees), pair.source, pair.target, graph)
                    expect(
                        not verdict.reliable,
                        "a wrong registration not to be relied on",
                        told(verdict),
                    )

    def test_the_frame_does_not_matter(self) -> None:
        back = se3.invert(MOTION)
        for name, (found, source, target, graph) in self.examples().items():
            with case(name):
                old = self.call(found, source, target, graph)
                pose = AXES_SWAPPED @ found.T_target_source @ back
                there = moved_view(source, MOTION), moved_view(target, AXES_SWAPPED)
                before = ViewGraph(  # of the same two views, which all of them are
                    tuple(
                        replace(e, T_target_source=AXES_SWAPPED @ e.T_target_source @ back)
                        for e in graph
                    )
                )
                self.same(old, self.call(replace(found, T_target_source=pose), *there, before))

    def test_the_unit_of_length_does_not_matter(self) -> None:
        for name, (found, source, target, graph) in self.examples().items():
            with case(name):
                old = self.call(found, source, target, graph)
                for unit in UNITS:
                    others: tuple[Registration, View, View] = (
                        scaled_registration(found, unit),
                        scaled_view(source, unit),
                        scaled_view(target, unit),
                    )
                    before = ViewGraph(tuple(scaled_edge(edge, unit) for edge in graph))
                    self.same(old, self.call(*others, before))

    def same(self, old: Verdict, new: Verdict) -> None:
        """Check that two verdicts agree; scores may have a unit, their ratio has none."""
        equal(
            "the same verdict in another frame or unit of length",
            (new.reliable, new.reason),
            (old.reliable, old.reason),
        )
        if old.threshold:
            ratio = new.score / new.threshold
            close(
                "the same ratio of score and threshold in another frame or unit",
                ratio,
                old.score / old.threshold,
                rtol=1e-6,
            )
