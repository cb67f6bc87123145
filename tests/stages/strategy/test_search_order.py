"""The order of attempts, kept up to date group by group, against one that is told from scratch."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.search import Search
from mvreg.testing import blob_views


def from_scratch(search):
    """The first of what `Search.batch` says, from the overlap scores alone."""
    models, found = search.models, []
    sizes = {int(g): len(models.members(int(g))) for g in models.group}
    for members in models.groups():
        label = int(models.group[members[0]])
        for source, own in enumerate(models.group.tolist()):
            if own == label or sizes[own] > sizes[label]:
                continue
            if search.failures[source] >= search.max_failures + sizes[own] - 1:
                continue
            best = search.scores[source, members].max()
            found.append((best * search.factor[source], source, members))
    for _, source, members in sorted(found, key=lambda one: -one[0]):
        for targets in search.targets(source, members):
            if (source, frozenset(targets)) not in search.tried:
                return source, targets
    return None


@pytest.mark.parametrize("seed", range(6))
def test_the_next_attempt_is_the_one_that_scores_most(seed):
    rng, view = np.random.default_rng(seed), blob_views()[0]
    count = 14
    models = PartialModels([replace(view, name=str(k)) for k in range(count)])
    scores = rng.random((count, count))
    if seed % 2:
        scores = np.round(4 * scores) / 4  # of equals the first
    scores = np.triu(scores, 1) + np.triu(scores, 1).T
    search = Search(scores, models, parts=3, max_failures=6)
    attempts = joins = 0
    while batch := search.batch():
        found = batch[0]
        assert found == from_scratch(search)
        attempts += 1
        if rng.random() < 0.3:
            models.join(found[0], found[1][0], np.eye(4))
            search.joined()
            joins += 1
            if rng.random() < 0.2:
                models.leave(int(rng.integers(count)))
        else:
            search.failed(*found)
    assert attempts > 25 and joins > 5


def two_groups(size):
    """A search over two groups of so many views, where every pair promises about as much."""
    view = blob_views()[0]
    models = PartialModels([replace(view, name=str(k)) for k in range(2 * size)])
    for k in range(1, size):
        models.join(k, 0, np.eye(4))
        models.join(size + k, size, np.eye(4))
    rng = np.random.default_rng(0)
    scores = 0.9 + 0.1 * rng.random((2 * size, 2 * size))
    return Search(np.triu(scores, 1) + np.triu(scores, 1).T, models, parts=3, max_failures=30)


def failed(search, batch):
    for source, targets in batch:
        search.failed(source, targets)
    return len(batch)


def test_rounds_in_vain_grow():
    search = two_groups(20)
    sizes = []
    for _ in range(6):
        batch = search.batch()
        assert len({source for source, _ in batch}) == len(batch), "a view moves once in a round"
        assert not any((source, frozenset(targets)) in search.tried for source, targets in batch)
        sizes.append(failed(search, batch))
    assert sizes == [1, 2, 4, 8, 16, 16]


def test_after_a_join_rounds_are_as_small_as_they_can_be():
    search = two_groups(20)
    for _ in range(3):
        failed(search, search.batch())
    search.joined()
    assert len(search.batch()) == 1
