"""What a stage of each kind that a pair goes through must do; and data sets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from mvreg.evidence.pooled import Evidence, ViewPair
from mvreg.types import (
    Array,
    Candidates,
    Features,
    Matches,
    Model,
    Registration,
    Sample,
    Scan,
    ScanSet,
    Verdict,
    View,
    ViewGraph,
)


class Dataset(Protocol):
    """Finds scans."""

    def __call__(self, rng: np.random.Generator) -> ScanSet:
        """Load the scans; `rng` serves orders and motions drawn at random."""


class Downsample(Protocol):
    """Thins scans out, twice: points to refine on, and keypoints to search with."""

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        """Return a sample per scan, and the spacing of the keypoints, common to all (length).

        It sees all the scans at once because the spacing must be one for the whole set.
        """


class Describe(Protocol):
    """Gives every keypoint a descriptor that does not change under rigid motion."""

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        """Describe `keypoints` (K, 3) of the scan; those that cannot be described are left out.

        The rest keeps its order. The number of scales L and of descriptors' entries D must not
        depend on the scan. Called from several threads.
        """


class Seed(Protocol):
    """Proposes matches by descriptor alone."""

    def __call__(self, source: View, target: View) -> Matches:
        """Return seed matches, by ascending distance; may be empty."""


class Propagate(Protocol):
    """Turns seed matches into hypotheses for the pose."""

    def __call__(
        self, source: View, target: View, seeds: Matches, rng: np.random.Generator
    ) -> Candidates:
        """Return candidate poses ``T_target_source`` (C, 4, 4), by ascending score; may be empty.

        `seeds` may be empty, or have been made by any other stage. Where both views have a
        vertical, `View.up`, poses should keep to it: nothing else forbids them.
        """


class Refine(Protocol):
    """Makes a coarse pose accurate."""

    def __call__(self, source: View, target: View, T_init: Array) -> Registration:
        """Return the pose near `T_init` (4, 4) that fits the source to the target best.

        It rests on one pair at least; the order of `pairs` is free. `Pipeline.register` calls it
        from several threads, first on few points of the source, and compares the objectives.
        """


class Judge(Protocol):
    """Says whether a registration can be relied on."""

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        """Judge `registration`, given the `graph` of the pairs accepted so far.

        The graph holds what the strategy relies on now, in the order in which it was accepted: not
        what was refused, nor what was withdrawn. Where it already leads from source to target,
        the registration closes a loop, see `ViewGraph.loop`.
        """


@runtime_checkable
class JointJudge(Judge, Protocol):
    """A judge that can pool the evidence of several view pairs, as ``judge=evidence`` does."""

    def together(self, pairs: Sequence[ViewPair]) -> Evidence:
        """Pool what `pairs` show: how probable it is that all of them are right, and why not."""


@runtime_checkable
class ScreeningJudge(Judge, Protocol):
    """A judge that can reject a pose early: seen on few points, before it is refined on all."""

    def rejected_early(
        self, registration: Registration, few: View, target: View, graph: ViewGraph, factor: float
    ) -> bool:
        """Whether a pose refined on `few` of the source's points scores so badly.

        That is, worse than `factor` times the threshold; what it misses costs time, what it turns
        away is lost. A judge whose score is no residual need not have this: then no pose is turned
        away early.
        """


class Augment(Protocol):
    """Merges an accepted view into the model."""

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        """Return the model with the source in it; the model frame stays."""
