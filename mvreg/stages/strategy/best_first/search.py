"""The order of attempts: what has been tried, and which pair is the most promising."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.types import Array, Indices

#: What is left of the overlap scores of a source, and of its pairs with the targets, after a
#: failure.
SOURCE_LEFT, PAIR_LEFT = 0.9, 0.5
#: After so many failures in a row for every scan, and so many at least, nothing more is tried. Sets
#: that can be joined take 1.1 attempts a scan in all (``+experiment=orders``).
IN_A_ROW, LEAST_IN_A_ROW = 2, 12


class Search:
    """What has been tried so far, and what is to be tried next.

    Parameters
    ----------
    scores : (N, N) array
        See `mvreg.stages.strategy.best_first.overlap_score`.
    models : PartialModels
        Of the same views; changed from outside.
    parts, max_failures : int
        See `BestFirst`.
    """

    def __init__(self, scores: Array, models: PartialModels, parts: int, max_failures: int) -> None:
        self.scores = scores.copy()
        self.models = models
        self.parts, self.max_failures = parts, max_failures
        self.factor = np.ones(len(scores))
        self.failures = np.zeros(len(scores), dtype=int)  # of the partial models it was in
        self.misses = np.zeros(len(scores), dtype=int)  # its own
        self.tried: set[tuple[int, frozenset[int]]] = set()
        self.registered: set[frozenset[int]] = set()  # pairs: source and first target
        self.suggested: list[tuple[int, int]] = []
        self.in_a_row = 0
        self.gains = np.zeros((len(scores), len(scores) + 1))
        self.grouping: Indices = np.full(len(scores), -1)  # the groups that `gains` are of
        self.stale: set[int] = set()

    def suggest(self, first: int, second: int) -> None:
        """Register this pair next: it closes a loop that decides."""
        self.suggested.append((first, second))

    def next(self) -> tuple[int, list[int]] | None:
        """What to try next, see `most_promising`; pairs suggested come before."""
        found = self.suggestion() or self.most_promising()
        if found is not None:
            self.registered.add(frozenset((found[0], found[1][0])))
        return found

    def suggestion(self) -> tuple[int, list[int]] | None:
        """The last pair suggested that is of two partial models, and was not tried."""
        group = self.models.group
        while self.suggested:
            pair = self.suggested.pop()
            if group[pair[0]] != group[pair[1]] and frozenset(pair) not in self.registered:
                sizes = [int((group == group[k]).sum()) for k in pair]
                source, target = pair if sizes[0] <= sizes[1] else pair[::-1]
                return source, [target]
        return None

    def most_promising(self) -> tuple[int, list[int]] | None:
        """The view to move and the views to move it to, most promising first; None at the end.

        It moves to the larger group, or to one of the same size.
        """
        if self.in_a_row >= max(LEAST_IN_A_ROW, IN_A_ROW * len(self.scores)):
            return None
        group = self.models.group
        groups = [members for members in self.models.groups() if len(members)]
        labels = np.array([group[members[0]] for members in groups], dtype=np.intp)
        self.refresh()
        # In the order of the groups, then of the sources: of equals the first is taken.
        priority = np.where(self.may_move(labels), self.gains[:, labels].T * self.factor, -np.inf)
        while (
            priority.size
            and (best := int(priority.argmax())) >= 0
            and priority.flat[best] > -np.inf
        ):
            row, source = divmod(best, len(group))
            for targets in self.targets(source, groups[row]):
                if (source, frozenset(targets)) not in self.tried:
                    return source, targets
            priority.flat[best] = -np.inf
        return None

    def refresh(self) -> None:
        """The overlap score of every view with each group: again only for groups that have changed.

        That is its score with the one view of the group that it looks most like. A sum over
        several would be larger for large groups, whatever they show: of 300 scans of a long column
        most were tried in vain against one of 92, before the scans beside them.
        """
        group = self.models.group
        moved = group != self.grouping
        for label in {*group[moved].tolist(), *self.grouping[moved].tolist(), *self.stale} - {-1}:
            self.gains[:, label] = self.scores[:, group == label].max(axis=1, initial=0.0)
        self.grouping = group.copy()
        self.stale.clear()

    def may_move(self, labels: Indices) -> Flags:
        """Which views (N) may still be moved to each of the groups (G): (G, N)."""
        group = self.models.group
        sizes = np.bincount(group, minlength=len(group) + 1)
        smaller = sizes[group] <= sizes[labels][:, None]
        patient = self.failures < self.max_failures + sizes[group] - 1
        allowed: Flags = patient & (group != labels[:, None]) & smaller
        return allowed

    def targets(self, source: int, members: Indices) -> Iterator[list[int]]:
        """Views of a group to register to: those to be tried now, then whatever else there is.

        The most promising ones merged and, after a failure, the most promising alone: a merged
        target is met by more of the source, a single one has fewer keypoints that mislead. By
        turns, and with more of them merged each time.
        """
        order = [int(k) for k in members[np.argsort(-self.scores[source, members], kind="stable")]]
        rounds, alone = divmod(int(self.misses[source]), 2)
        yield order[:1] if alone else order[: self.parts * (1 + rounds)]
        yield from ([k] for k in order)
        yield order

    def joined(self) -> None:
        """An attempt was a success."""
        self.in_a_row = 0

    def failed(self, source: int, targets: Sequence[int]) -> None:
        """The attempt failed: lower the overlap scores of the source and of these pairs."""
        self.tried.add((source, frozenset(targets)))
        self.in_a_row += 1
        self.factor[source] *= SOURCE_LEFT
        self.scores[source, targets] *= PAIR_LEFT
        self.scores[targets, source] *= PAIR_LEFT
        self.stale.update(self.models.group[[source, *targets]].tolist())
        moving = self.models.members(int(self.models.group[source]))
        self.failures[moving] += 1
        self.misses[source] += 1
