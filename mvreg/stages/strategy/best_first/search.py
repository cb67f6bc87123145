"""The order of attempts: what has been tried, and which pairs are the most promising."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

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
#: Pairs that promise less than this share of the best one wait for another round: by then the
#: partial models have grown, and show more.
AS_PROMISING = 0.5
#: After rounds in vain twice as many attempts are made at once each time, so many at most: the last
#: scans of 300 took twenty rounds of one attempt each, in which one worker had something to do.
MOST_AT_ONCE = 16


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
        self.before, self.in_vain = 0, 0  # attempts of the round before, and rounds without a join
        self.gains = np.zeros((len(scores), len(scores) + 1))
        self.grouping: Indices = np.full(len(scores), -1)  # the groups that `gains` are of
        self.stale: set[int] = set()

    def suggest(self, first: int, second: int) -> None:
        """Register this pair next: it closes a loop that decides."""
        self.suggested.append((first, second))

    def batch(self) -> list[tuple[int, list[int]]]:
        """What to try next, side by side: views to move, each with the views to move it to.

        Each partial model's most promising pair, as in Boruvka's algorithm for spanning trees; the
        pairs suggested come before. What depends on another attempt of the batch waits: a partial
        model moves once, and not while others move to it; but after rounds in vain the next most
        promising pairs are tried along with these, see `MOST_AT_ONCE`. Which they are depends on
        what is known by now alone, not on who works on them. Empty at the end.
        """
        moves: dict[int, bool] = {}  # by group: it moves, or others move to it
        group, chosen, later = self.models.group, [], list[tuple[int, int]]()

        def fits(source: int, target: int) -> bool:
            moving, staying = int(group[source]), int(group[target])
            if moving in moves or moves.get(staying, False):
                return False
            moves[moving], moves[staying] = True, False
            self.registered.add(frozenset((source, target)))
            return True

        for source, target in self.suggestions():
            if fits(source, target):
                chosen.append((source, [target]))
            else:
                later.append((source, target))
        self.suggested = later[::-1]
        chosen += [one for one in self.promising() if fits(one[0], one[1][0])]
        self.in_vain = self.in_vain + 1 if 0 < self.before <= self.in_a_row else 0
        if chosen:
            room = min(2**self.in_vain, MOST_AT_ONCE) - len(chosen)
            chosen += islice(self.further({source for source, _ in chosen}), max(0, room))
        self.before = len(chosen)
        return chosen

    def suggestions(self) -> Iterator[tuple[int, int]]:
        """The pairs suggested that are of two partial models and were not tried, last first."""
        group = self.models.group
        for pair in reversed(self.suggested):
            if group[pair[0]] != group[pair[1]] and frozenset(pair) not in self.registered:
                sizes = [int((group == group[k]).sum()) for k in pair]
                yield pair if sizes[0] <= sizes[1] else pair[::-1]

    def promising(self) -> Iterator[tuple[int, list[int]]]:
        """For every group the most promising pair with another, the best first.

        A view moves to the larger group, or to one of the same size.
        """
        if self.in_a_row >= max(LEAST_IN_A_ROW, IN_A_ROW * len(self.scores)):
            return
        group = self.models.group
        groups, priority = self.priorities()
        seen: set[int] = set()
        least = -np.inf
        for cell in descending(priority):
            if priority.flat[cell] < least or len(seen) == len(groups):
                return
            row, source = divmod(cell, len(group))
            ends = {int(group[source]), int(group[groups[row][0]])}
            if ends <= seen:
                continue
            targets = self.untried(source, groups[row])
            if targets is not None:
                if not seen:
                    least = AS_PROMISING * float(priority.flat[cell])
                seen |= ends
                yield source, targets

    def further(self, sources: set[int]) -> Iterator[tuple[int, list[int]]]:
        """The next most promising pairs, of views that do not move yet, the best first."""
        groups, priority = self.priorities()
        least = AS_PROMISING * float(priority.max(initial=-np.inf))
        for cell in descending(priority):
            if priority.flat[cell] < least:
                return
            row, source = divmod(cell, len(self.models.group))
            targets = None if source in sources else self.untried(source, groups[row])
            if targets is not None:
                sources.add(source)
                self.registered.add(frozenset((source, targets[0])))
                yield source, targets

    def priorities(self) -> tuple[list[Indices], Array]:
        """The groups (G), the largest first, and what moving each view there promises: (G, N)."""
        group = self.models.group
        groups = [members for members in self.models.groups() if len(members)]
        labels = np.array([group[members[0]] for members in groups], dtype=np.intp)
        self.refresh()
        # In the order of the groups, then of the sources: of equals the first is taken.
        return groups, np.where(
            self.may_move(labels), self.gains[:, labels].T * self.factor, -np.inf
        )

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

    def untried(self, source: int, members: Indices) -> list[int] | None:
        """The first of `targets` that the source was not tried with yet; None if there is none."""
        choices = self.targets(source, members)
        return next((one for one in choices if (source, frozenset(one)) not in self.tried), None)

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


def descending(priority: Array) -> Iterator[int]:
    """Positions in a flat array of the finite entries, the largest first, of equals the first.

    Sorted in parts: mostly the first few are asked for.
    """
    flat = priority.ravel()
    upper = np.inf
    while (left := np.flatnonzero((flat < upper) & (flat > -np.inf))).size:
        lower = AS_PROMISING * flat[left].max()
        part = left[flat[left] >= lower] if lower > 0 else left
        yield from part[np.argsort(-flat[part], kind="stable")].tolist()
        upper = lower if lower > 0 else -np.inf
