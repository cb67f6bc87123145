"""Attempts made before their turn: nobody can tell, whatever the number of threads."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg import parallel
from mvreg.events import PairRegistered, PairStarted
from mvreg.stages.attempts import Attempts
from mvreg.stages.best_first_search import Search
from mvreg.stages.partial_models import PartialModels
from mvreg.testing.views import blob_views, pipeline
from mvreg.types import Candidates, Matches, Pair, Verdict

COUNT = 16


def models_and_search(seed):
    view = blob_views()[0]
    models = PartialModels([replace(view, name=str(k)) for k in range(COUNT)])
    promises = np.random.default_rng(seed).random((COUNT, COUNT))
    promises = np.triu(promises, 1) + np.triu(promises, 1).T
    return models, Search(promises, models, parts=3, patience=6)


def grown(seed, threads, monkeypatch):
    """What a search comes to: attempts in their order, what was told, and how many were made.

    An attempt's outcome follows from its random numbers and from the two groups that it is about.
    """
    monkeypatch.setattr(parallel, "threads", lambda: threads)
    monkeypatch.setattr("mvreg.stages.attempts.threads", lambda: threads)
    models, search = models_and_search(seed)
    made, told, order = [], [], []

    def make(source, targets, pipeline, rng):
        groups = [models.members(int(models.group[k])).tolist() for k in (source, targets[0])]
        made.append((source, *targets))
        pipeline.emit(PairStarted(models.views[source], models.views[targets[0]]))
        number = float(rng.random()) + sum(map(sum, groups))
        verdict = Verdict(number % 1 < 0.6, number, 0.0, str(groups))
        pair = Pair(str(source), str(targets[0]), verdict, seconds={"seed": 1.0})
        pipeline.emit(
            PairRegistered(
                models.views[source], models.views[targets[0]], Matches.none(), Candidates.none(),
                None, pair,
            )
        )  # fmt: skip
        return None, pair

    rng = np.random.default_rng(seed)
    attempts = Attempts(search, pipeline().observed_by(told.append), make, rng)
    while (found := attempts.next()) is not None:
        source, targets, (_, pair) = found
        now = [models.members(int(models.group[k])).tolist() for k in (source, targets[0])]
        assert pair.verdict.reason == str(now), "made of groups that are no more"
        order.append((source, *targets, pair.verdict.score))
        if pair.verdict.reliable:
            attempts.changed(*models.group[[source, targets[0]]].tolist())
            models.join(source, targets[0], np.eye(4))
            search.joined()
        else:
            search.failed(source, targets)
    return order, told, made, models.group


@pytest.mark.parametrize("seed", range(5))
def test_the_answers_do_not_depend_on_the_number_of_threads(seed, monkeypatch):
    alone = grown(seed, 1, monkeypatch)
    beside = grown(seed, 3, monkeypatch)
    assert alone[0] == beside[0]
    np.testing.assert_array_equal(alone[3], beside[3])
    assert [one[:-1] for one in alone[0]] == alone[2], "one thread makes none in vain"
    assert len(alone[0]) > COUNT - 2


@pytest.mark.parametrize("threads", [1, 3])
def test_observers_are_told_of_each_when_its_turn_comes(threads, monkeypatch):
    order, told, made, _ = grown(2, threads, monkeypatch)
    started = [event for event in told if isinstance(event, PairStarted)]
    registered = [event for event in told if isinstance(event, PairRegistered)]
    assert [event.source.name for event in started] == [str(one[0]) for one in order]
    assert [event.pair.verdict.score for event in registered] == [one[-1] for one in order]
    assert len(made) >= len(order)


def test_attempts_side_by_side_take_as_long_as_they_took_together(monkeypatch):
    _, told, _, _ = grown(0, 3, monkeypatch)
    seconds = [e.pair.seconds["seed"] for e in told if isinstance(e, PairRegistered)]
    assert min(seconds) < 0.5, "they said a second each, and took next to nothing"


@pytest.mark.parametrize("seed", range(4))
def test_those_ahead_are_about_different_groups_and_the_next_comes_first(seed):
    models, search = models_and_search(seed)
    for source, target in ((3, 4), (5, 4), (8, 9)):
        models.join(source, target, np.eye(4))
    ahead = list(search.ahead())
    assert ahead[0] == search.next()
    groups = [int(models.group[k]) for source, targets in ahead for k in (source, targets[0])]
    assert len(groups) == len(set(groups)) > 8
    (source, targets), *rest = ahead
    models.join(source, targets[0], np.eye(4))
    search.joined()
    assert [one for one in search.ahead() if one in rest], "they are still to come"
