"""Hypotheses of pairs that no verdict settles by itself, and loops that settle them together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.types import Array

#: Less probable hypotheses are not kept. At 0.1 loops of right pairs only close on the campus, the
#: desk and the Stanford sets, see ``experiments/accuracy/loops.py``.
LEAST_PROBABILITY = 0.1
#: No single pair is taken for more certain than this: its evidence may repeat itself elsewhere.
MOST_PROBABILITY = 0.95
#: The probability that a wrong pose agrees with what the other pairs of a loop say; and of one that
#: has a rival at least half as probable, as slides along a corridor have: those agree more often.
CHANCE, CHANCE_OF_RIVALS, RIVAL = 0.02, 0.2, 0.5
#: Poses agree if they put the points of a view so near each other (RMS, in resolutions), times the
#: root of the number of pairs in the loop.
TOLERANCE = 4.0
#: Points of a view that poses are compared by.
COMPARED = 64


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A relative pose of views `source` and `target`, right with `probability` by itself.

    `attempt` is the position of the pair that it comes from among all attempts; `chance` the
    probability that it would agree with others if it were wrong.
    """

    source: int
    target: int
    T_target_source: Array
    probability: float
    attempt: int = 0
    chance: float = CHANCE

    @property
    def pair(self) -> frozenset[int]:
        """The views, in no order."""
        return frozenset((self.source, self.target))


@dataclass(frozen=True, eq=False)
class Bundle:
    """Hypotheses of different pairs that agree on how group `ends[0]` lies in `ends[1]`.

    `motion` (4, 4) is ``T_ends1_ends0``, that of the most probable; `against` holds the hypotheses
    of other pairs of views of the same groups that say something else.
    """

    ends: tuple[int, int]
    motion: Array
    members: tuple[Hypothesis, ...]
    against: tuple[Hypothesis, ...]

    @property
    def counted(self) -> list[Hypothesis]:
        """The two most probable: what else agrees with them is not independent.

        In a building that repeats itself many pairs agree on one wrong answer.
        """
        return sorted(self.members, key=lambda one: -one.probability)[:2]

    @property
    def right(self) -> float:
        """The probability that the members counted are right, as if they were independent."""
        return float(np.prod([one.probability for one in self.counted]))

    @property
    def wrong(self) -> float:
        """That they are wrong, and agree by chance if there are two."""
        wrong = np.prod([1 - one.probability for one in self.counted])
        chances = sorted(one.chance for one in self.counted)
        return float(wrong * np.prod(chances[1:]))

    @property
    def chance(self) -> float:
        """The probability that it closes a loop if it is wrong."""
        return min(one.chance for one in self.members)

    @property
    def contradicted(self) -> float:
        """The probability that everything against the motion is wrong."""
        return float(np.prod([1 - one.probability for one in self.against]))


@dataclass(frozen=True, eq=False)
class Agreement:
    """Bundles that close a loop, and the odds that they are right rather than wrong by chance.

    Of one bundle of two pairs or more the loop runs through the groups; three bundles lead around
    three groups, of which at least two would have to be wrong, and fit, if one is.
    """

    bundles: tuple[Bundle, ...]

    @property
    def odds(self) -> float:
        """Of all being right against the loop closing by chance."""
        right = float(np.prod([bundle.right * bundle.contradicted for bundle in self.bundles]))
        return right / max(self.chance, 1e-300)

    @property
    def chance(self) -> float:
        """The probability that the loop closes although some of it is wrong."""
        if len(self.bundles) == 1:
            return self.bundles[0].wrong
        wrong = [bundle.wrong for bundle in self.bundles]
        right = [bundle.right for bundle in self.bundles]
        two = sum(wrong[a] * wrong[b] * right[3 - a - b] for a, b in combinations(range(3), 2))
        return max(one.chance for one in self.bundles) * (two + float(np.prod(wrong)))

    @property
    def edges(self) -> list[Hypothesis]:
        """The most probable hypothesis of each bundle; the best two of three bundles join all."""
        best = [max(one.members, key=lambda edge: edge.probability) for one in self.bundles]
        order = sorted(best, key=lambda edge: -edge.probability)
        return order[: max(1, len(order) - 1)]


class Hypotheses:
    """All that is known of pairs of views that are not in one group yet.

    Parameters
    ----------
    models : PartialModels
        Changed from outside; hypotheses within one of its groups say nothing any more.
    """

    def __init__(self, models: PartialModels) -> None:
        self.models = models
        self.known: list[Hypothesis] = []
        self.samples = [
            view.points[:: -(-len(view.points) // COMPARED) or 1] for view in models.views
        ]

    def add(
        self,
        source: int,
        target: int,
        poses: Sequence[Array],
        probabilities: Sequence[float],
        attempt: int = 0,
    ) -> list[Hypothesis]:
        """Keep the poses of one attempt, of which one at most is right, as far as probable."""
        kept = []
        odds = np.array([min(p, MOST_PROBABILITY) for p in probabilities])
        odds = odds / (1 - odds)
        shares = odds / (1 + odds.sum())
        for k, (pose, share) in enumerate(zip(poses, shares, strict=True)):
            if share >= LEAST_PROBABILITY:
                rival = np.delete(shares, k).max(initial=0.0) >= RIVAL * share
                chance = CHANCE_OF_RIVALS if rival else CHANCE
                kept.append(Hypothesis(source, target, pose, float(share), attempt, chance))
        self.known += kept
        return kept

    def different(self, source: int, poses: Sequence[Array]) -> list[Array]:
        """The poses of view `source` that differ, the first of each."""
        return [poses[k] for k in self.distinct(source, poses)]

    def distinct(self, source: int, poses: Sequence[Array]) -> list[int]:
        """Positions of the poses of view `source` that differ, the first of each."""
        apart = TOLERANCE * self.models.views[source].scale.resolution
        kept: dict[int, Array] = {}
        for k, pose in enumerate(poses):
            moved = se3.apply(pose, self.samples[source])
            gaps = [np.sqrt(((moved - other) ** 2).sum(axis=1).mean()) for other in kept.values()]
            if min(gaps, default=np.inf) > apart:
                kept[k] = moved
        return list(kept)

    def agreements(self) -> list[Agreement]:
        """Every loop that closes, the best first, with odds that the rivals leave it."""
        bundles = self.bundles()
        found = [
            Agreement((bundle,))
            for between in bundles.values()
            for bundle in between
            if len(bundle.members) > 1
        ]
        found += list(self.triangles(bundles))
        return sorted(found, key=lambda one: -one.odds)

    def bundles(self) -> dict[tuple[int, int], list[Bundle]]:
        """The hypotheses between every two groups, bundled by what they say."""
        group = self.models.group
        between: dict[tuple[int, int], list[Hypothesis]] = {}
        for one in self.known:
            a, b = int(group[one.source]), int(group[one.target])
            if a != b:
                between.setdefault((min(a, b), max(a, b)), []).append(one)
        return {ends: self.bundled(ends, found) for ends, found in between.items()}

    def bundled(self, ends: tuple[int, int], found: Sequence[Hypothesis]) -> list[Bundle]:
        """Bundle the hypotheses between two groups: one of each pair of views in a bundle."""
        order = sorted(found, key=lambda one: -one.probability)
        motions = [self.motion(one, ends) for one in order]
        bundles: list[Bundle] = []
        taken: set[int] = set()
        for k, seed in enumerate(order):
            if k in taken:
                continue
            agree = [
                m for m, other in enumerate(order)
                if self.apart(ends[0], motions[k], motions[m], (seed, other)) <= TOLERANCE * 2**0.5
            ]  # fmt: skip
            taken.update(agree)
            best = {order[m].pair: order[m] for m in reversed(agree)}
            against = {
                order[m].pair: order[m]
                for m in reversed(range(len(order)))
                if m not in agree and order[m].pair not in best
            }
            bundles.append(Bundle(ends, motions[k], tuple(best.values()), tuple(against.values())))
        return bundles

    def motion(self, one: Hypothesis, ends: tuple[int, int]) -> Array:
        """``T_ends1_ends0`` (4, 4) that a hypothesis amounts to."""
        poses = self.models.poses
        motion = poses[one.target] @ one.T_target_source @ se3.invert(poses[one.source])
        turned = int(self.models.group[one.source]) != ends[0]
        return se3.invert(motion) if turned else motion

    def apart(self, group: int, first: Array, second: Array, edges: Sequence[Hypothesis]) -> float:
        """How far apart two motions put the edges' views of a group (RMS, resolutions)."""
        models = self.models
        chosen = {k for edge in edges for k in edge.pair if models.group[k] == group}
        gaps = [0.0]
        for k in chosen:
            points = se3.apply(models.poses[k], self.samples[k])
            gap = se3.apply(first, points) - se3.apply(second, points)
            gaps.append(float(np.sqrt((gap**2).sum(axis=1).mean())) if len(gap) else 0.0)
        return max(gaps) / (models.views[edges[0].source].scale.resolution or 1.0)

    def triangles(self, bundles: dict[tuple[int, int], list[Bundle]]) -> Iterator[Agreement]:
        """Three bundles that lead around three groups and back."""
        ways: dict[int, set[int]] = {}
        for a, b in bundles:
            ways.setdefault(a, set()).add(b)
            ways.setdefault(b, set()).add(a)
        for a, b in bundles:
            for c in sorted(ways[a] & ways[b]):
                if c < b:
                    continue
                for ab in bundles[a, b]:
                    for bc in bundles[b, c]:
                        for ac in bundles[a, c]:
                            edges = (*ab.members[:1], *bc.members[:1], *ac.members[:1])
                            around = bc.motion @ ab.motion
                            if self.apart(a, around, ac.motion, edges) <= TOLERANCE * 3**0.5:
                                yield Agreement((ab, bc, ac))
