"""What a run hands over: the record of every attempt, and every pose that was found.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mvreg.errors import RecordError
from mvreg.geometry import se3
from mvreg.geometry.arrays import Array
from mvreg.types import checks
from mvreg.types.records import Verdict
from mvreg.types.scatter import Pattern, PoseScatter, ScanScale
from mvreg.types.view import Model, View


@dataclass(frozen=True, eq=False)
class Answer:
    """One of several poses of a pair of scans that may be the right one.

    `confidence` is the probability that it is; `apart` is how far it has the points of the source
    from where the first of the answers has them (root mean square, length).
    """

    T_target_source: Array
    confidence: float
    apart: float = 0.0

    def __post_init__(self) -> None:
        checks.number("Answer.confidence", self.confidence, 0.0, 1.0)
        checks.length("Answer.apart", self.apart)
        checks.keep(
            self, T_target_source=checks.pose("Answer.T_target_source", self.T_target_source)
        )


@dataclass(frozen=True, eq=False)
class Pair:
    """The record of one attempted pair-wise registration; a row of ``pairs.csv``.

    `T_target_source`, `overlap` and `trimmed_mse` are None where there was no candidate;
    `seconds` maps a stage's kind to the time that it took. `answers` are the poses that may be
    right, the most probable first, where there are several; empty where there are not, or where a
    strategy does not tell.
    """

    source: str
    target: str
    verdict: Verdict
    T_target_source: Array | None = None
    overlap: float | None = None
    trimmed_mse: float | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)
    answers: tuple[Answer, ...] = ()

    def __post_init__(self) -> None:
        checks.text("Pair.source", self.source)
        checks.text("Pair.target", self.target)
        checks.instance("Pair.verdict", self.verdict, Verdict)
        if self.T_target_source is not None:
            T_target_source = checks.pose("Pair.T_target_source", self.T_target_source)
            checks.keep(self, T_target_source=T_target_source)
        if self.overlap is not None:
            checks.number("Pair.overlap", self.overlap, 0.0, 1.0)
        if self.trimmed_mse is not None:
            checks.length("Pair.trimmed_mse", self.trimmed_mse)
        for answer in self.answers:
            checks.instance("Pair.answers", answer, Answer)


@dataclass(frozen=True, eq=False)
class Link:
    """Two placed scans that overlap, under the poses of a result.

    `points` of the source lie on the target's surface, at a root mean square point-to-plane
    distance of `rms` (length). `covariance` (6, 6), where an adjustment tells it, is that of the
    relative pose: of the small motion ``exp(twist) @ T_target_source`` in the target's frame, three
    of rotation (radians) before three of translation (length).
    """

    source: str
    target: str
    points: int
    rms: float
    covariance: Array | None = None

    def __post_init__(self) -> None:
        checks.text("Link.source", self.source)
        checks.text("Link.target", self.target)
        checks.length("Link.points", self.points)
        checks.length("Link.rms", self.rms)
        if self.covariance is not None:
            checks.floats("Link.covariance", self.covariance, 6, 6)

    def covariance_back(self, T_target_source: Array) -> Array | None:
        """The covariance (6, 6) of the same relative pose seen the other way round.

        Of the small motion ``exp(twist) @ T_source_target`` in the source's frame, as `covariance`
        is of ``exp(twist) @ T_target_source``: the two are adjoint transforms of each other.

        Parameters
        ----------
        T_target_source : (4, 4) array
            Of the result that the link is of, ``x_target = T_target_source @ x_source``.

        Returns
        -------
        (6, 6) array or None
            None where `covariance` is.
        """
        if self.covariance is None:
            return None
        change = se3.adjoint(se3.invert(checks.pose("T_target_source", T_target_source)))
        found: Array = change @ self.covariance @ change.T
        return found


#: Fields of a `Result` that an adjustment fills, and what they are tuples of.
RECORDS = (
    ("links", Link), ("scatter", PoseScatter), ("patterns", Pattern), ("scales", ScanScale),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Result:
    """Every pose that was found.

    `poses` maps names to ``T_model_scan`` (4, 4), the identity for `reference`. `components` are
    the other partial models, which nothing reliable joins to the reference's: each maps names to
    poses in a frame of its own, that of its first scan. `unregistered` names the scans in neither.
    `pairs` has every attempt, in order; `model` is the merged view where the strategy keeps one.
    An `adjust` stage may add the `covariances` (6, 6) of the poses, of small motions
    ``exp(twist) @ T_model_scan``, three of rotation (radians) and three of translation (length),
    the `links` that it rests on, the `scatter` of all poses of a model at once, one for each
    model, which `mvreg.relative_covariance` asks, `patterns`, systematic errors of scans, and the
    `scales` of scans, where they are estimated.
    `views` are the scans as they were prepared, in the order in which they were given;
    `mvreg.register` fills them in, strategies leave them empty.
    """

    reference: str
    poses: Mapping[str, Array]
    unregistered: tuple[str, ...]
    pairs: tuple[Pair, ...]
    model: Model | None = None
    components: tuple[Mapping[str, Array], ...] = ()
    covariances: Mapping[str, Array] = field(default_factory=dict)
    links: tuple[Link, ...] = ()
    scatter: tuple[PoseScatter, ...] = field(default=(), repr=False)
    patterns: tuple[Pattern, ...] = ()
    scales: tuple[ScanScale, ...] = ()
    views: tuple[View, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        checks.text("Result.reference", self.reference)
        poses = checks.named_poses("Result.poses", self.poses)
        if self.reference not in poses:
            raise RecordError(
                f"Result.poses: expected a pose of the reference {self.reference!r}, "
                f"got poses of {', '.join(map(repr, poses)) or 'nothing'}"
            )
        recorded = [name for name, _ in RECORDS]
        for name in ("unregistered", "pairs", "components", *recorded, "views"):
            checks.instance(f"Result.{name}", getattr(self, name), tuple)
        components = tuple(
            checks.named_poses(f"Result.components[{index}]", one)
            for index, one in enumerate(self.components)
        )
        if any(new is not old for new, old in zip(components, self.components, strict=True)):
            checks.keep(self, components=components)
        checks.keep(self, poses=poses)
        checks.instance("Result.covariances", self.covariances, Mapping)
        for name, covariance in self.covariances.items():
            checks.floats(f"Result.covariances[{name!r}]", covariance, 6, 6)
        for name, kind in RECORDS:
            for index, one in enumerate(getattr(self, name)):
                checks.instance(f"Result.{name}[{index}]", one, kind)
        if self.model is not None:
            checks.instance("Result.model", self.model, Model)
