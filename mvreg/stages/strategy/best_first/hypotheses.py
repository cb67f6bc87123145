"""Hypotheses of pairs that no verdict settles by itself, and the loops that they close."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.agreement import (
    CHANCE,
    CHANCE_OF_RIVALS,
    RIVAL,
    Agreement,
    Bundle,
    Hypothesis,
)
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.surface.displacement import rms_apart
from mvreg.types import Array, View

#: Less probable hypotheses are not kept. At 0.1 loops of right pairs only close on the campus, the
#: desk and the Stanford sets, see ``experiments/accuracy/loops.py``.
LEAST_PROBABILITY = 0.1
#: No single pair is taken for more certain than this: its evidence may repeat itself elsewhere.
MOST_PROBABILITY = 0.95
#: Nor is a pose beside others of the same pair: odds are a thousand at most.
LEAST_DOUBT = 1e-3
#: Poses agree if they put the points of a view so near each other (RMS, in resolutions), times the
#: root of the number of pairs in the loop.
TOLERANCE = 4.0
#: Points of a view that poses are compared by.
COMPARED = 64


def compared(view: View) -> Array:
    """The points (C, 3) of a view that its poses are compared by."""
    return view.points[:: -(-len(view.points) // COMPARED) or 1]


def shares(probabilities: Sequence[float], plausibilities: Sequence[float]) -> Array:
    """The probability (C,) of each of the poses of a pair, of which one at most is right.

    Those that can slide are not probable, but rivals of the others: by their `plausibilities`.
    """
    odds, rivals = (_odds(each) for each in (probabilities, plausibilities))
    found: Array = odds / (1 + rivals.sum())
    return found


def _odds(probabilities: Sequence[float]) -> Array:
    return np.array([p / max(1 - p, LEAST_DOUBT) for p in probabilities])


def distinct(view: View, poses: Sequence[Array] | Array) -> list[int]:
    """Positions of the poses (4, 4) of a view that differ, the first of each."""
    motions = np.asarray(poses).reshape(-1, 4, 4)
    moved = compared(view) @ np.swapaxes(motions[:, :3, :3], 1, 2) + motions[:, None, :3, 3]
    apart = TOLERANCE * view.scale.resolution
    kept: list[int] = []
    for k, one in enumerate(moved):
        squared = ((moved[kept] - one) ** 2).sum(axis=2)
        rms = np.sqrt(squared.mean(axis=1)) if len(one) else np.zeros(len(kept))
        if (rms > apart).all():
            kept.append(k)
    return kept


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
        self.samples = [compared(view) for view in models.views]

    def add(
        self,
        source: int,
        target: int,
        poses: Sequence[Array],
        probabilities: Sequence[float],
        attempt: int = 0,
        plausibilities: Sequence[float] | None = None,
        confidence: float | None = None,
    ) -> list[Hypothesis]:
        """Keep the poses of one attempt, as far as they are probable; see `shares`.

        The most probable is no more so than with the judge's `confidence`, who asks for rivals
        that its symmetries make.
        """
        kept, best, judged = [], -1, 0.0
        others = probabilities if plausibilities is None else plausibilities
        odds, rivals = _odds(probabilities), _odds(others)
        found = np.minimum(shares(probabilities, others), MOST_PROBABILITY)
        if confidence is not None and len(found):
            best = int(np.argmax(probabilities))
            found[best] = min(found[best], confidence)
            judged = odds[best] / max(confidence, LEAST_DOUBT) - 1 - odds[best]
        for k, (pose, share) in enumerate(zip(poses, found, strict=True)):
            if share >= LEAST_PROBABILITY:
                most = max(np.delete(rivals, k).sum(), judged if k == best else 0.0)
                rival = most >= RIVAL * odds[k]
                chance = CHANCE_OF_RIVALS if rival else CHANCE
                kept.append(Hypothesis(source, target, pose, float(share), attempt, chance))
        self.known += kept
        return kept

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
        gaps = (
            rms_apart(se3.apply(models.poses[k], self.samples[k]), first, second) for k in chosen
        )
        return max(gaps, default=0.0) / (models.views[edges[0].source].scale.resolution or 1.0)

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
