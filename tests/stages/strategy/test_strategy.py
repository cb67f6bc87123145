"""The loop of `grow`, with pair-wise registrations that answer as the test says."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg import events
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.strategy.grow import GrowStrategy
from mvreg.testing import blob_views, pipeline
from mvreg.testing.views import registration
from mvreg.types import Pair, Part, Verdict

LEVELS = [{}, {"seed.top_fraction": 0.9}, {"seed.top_fraction": 1.0}]


class Scripted:
    """A pipeline that accepts a view at the level and model size that `needs` says."""

    def __init__(self, needs):
        self.pipeline = pipeline()
        self.needs = needs
        self.asked = []
        self.told = []
        self.level = None

    def with_parameters(self, changes):
        changed = self.pipeline.with_parameters(changes)
        copy = Scripted(self.needs)
        copy.asked, copy.told, copy.level = self.asked, self.told, changed.seed.top_fraction
        return copy

    def begin(self, reference):
        return self.pipeline.begin(reference)

    def extend(self, model, view, found):
        return replace(model, parts=(*model.parts, Part(view, np.eye(4))))

    def register(self, source, target, graph, rng, early_rejection=np.inf):
        size = len(target.members)
        self.asked.append((source.name, size, self.level, len(graph)))
        self.told.append(rng.random())
        level, least = self.needs[source.name]
        if level is None:
            return None, Pair(source.name, target.name, Verdict(False, np.inf, 0.0, "none"))
        good = self.level >= level and size >= least
        pose = se3.from_parts(np.eye(3), np.full(3, float(size)))
        found = registration(source, target, pose)
        verdict = Verdict(good, 1.0, 2.0, "scripted")
        return found, Pair(source.name, target.name, verdict, pose, 0.5, 1.0)


def views(count):
    first = blob_views(3)[0]
    return [replace(first, name=f"v{i}") for i in range(count)]


def grow(needs, levels=LEVELS):
    scripted = Scripted({"v0": (0, 0), **needs})
    strategy = GrowStrategy(levels=levels)
    result = strategy(views(len(needs) + 1), scripted, np.random.default_rng(0))
    return result, scripted


def test_each_view_is_tried_in_order_and_placed_once():
    result, script = grow({"v1": (0, 1), "v2": (0, 1), "v3": (0, 1)})
    assert [name for name, *_ in script.asked] == ["v1", "v2", "v3"]
    assert [(size, accepted) for _, size, _, accepted in script.asked] == [(1, 0), (2, 1), (3, 2)]
    assert (result.reference, result.unregistered) == ("v0", ())
    assert result.model.members == ("v0", "v1", "v2", "v3")
    np.testing.assert_array_equal(result.poses["v3"][:3, 3], [3, 3, 3])
    np.testing.assert_array_equal(result.poses["v0"], np.eye(4))
    assert len(result.pairs) == 3


def test_who_is_refused_is_tried_again_when_the_model_has_grown():
    result, script = grow({"v1": (0, 3), "v2": (0, 1), "v3": (0, 1)})
    assert [name for name, *_ in script.asked] == ["v1", "v2", "v3", "v1"]
    assert len({level for _, _, level, _ in script.asked}) == 1, "the first level was enough"
    assert result.unregistered == ()
    assert list(result.poses) == ["v0", "v2", "v3", "v1"]


def test_levels_rise_when_a_pass_accepts_nothing_and_fall_back_when_one_does():
    result, script = grow({"v1": (1.0, 1), "v2": (0, 2)})
    start = pipeline().seed.top_fraction
    assert [(name, level) for name, _, level, _ in script.asked] == [
        ("v1", start), ("v2", start),  # nothing
        ("v1", 0.9), ("v2", 0.9),  # nothing
        ("v1", 1.0), ("v2", 1.0),  # both: v1 made the model large enough
    ]  # fmt: skip
    assert result.unregistered == ()
    _, script = grow({"v1": (0.9, 1), "v2": (0, 3), "v3": (0.9, 2)})
    assert [(name, level) for name, _, level, _ in script.asked][3:] == [
        ("v1", 0.9), ("v2", 0.9), ("v3", 0.9), ("v2", start),
    ]  # fmt: skip


@pytest.mark.parametrize("levels", [[{}], LEVELS])
def test_it_ends_when_the_last_level_accepts_nothing(levels):
    result, _ = grow({"v1": (0, 1), "v2": (9, 9), "v3": (None, 0)}, levels)
    assert result.unregistered == ("v2", "v3")
    assert list(result.poses) == ["v0", "v1"]
    # A first pass over three; then passes over two, a level at a time, that place nothing.
    assert len(result.pairs) == 3 + 2 * len(levels)
    assert [pair.T_target_source is None for pair in result.pairs[-2:]] == [False, True]


def test_every_pair_has_random_numbers_of_its_own():
    _, first = grow({"v1": (0, 1), "v2": (9, 1), "v3": (0, 1)})
    _, again = grow({"v1": (0, 1), "v2": (9, 1), "v3": (0, 1)})
    assert first.told == again.told
    assert len(set(first.told)) == len(first.told)


def test_no_levels_are_refused():
    with pytest.raises(InputError, match=r"strategy\.levels: expected at least one level"):
        GrowStrategy(levels=[])


def test_a_level_that_names_nothing_is_refused_at_once():
    with pytest.raises(InputError, match=r"cannot change 'seed.top_frction'"):
        grow({"v1": (0, 1)}, [{"seed.top_frction": 1.0}])


def test_the_default_levels_suit_every_judge_of_the_core():
    from mvreg.plugins import manager

    judges = [
        stage.cls
        for key, stage in manager.stages().items()
        if key.startswith("judge/") and stage.plugin == "mvreg"
    ]
    assert len(judges) > 2 and GrowStrategy().levels
    for judge in judges:
        for level in GrowStrategy().levels:
            one = replace(pipeline(), judge=judge()).with_parameters(level)
            assert type(one.judge) is judge


def test_observers_see_the_model_grow():
    told = []
    views_ = list(blob_views(3))
    pipe = pipeline().observed_by(told.append)
    result = GrowStrategy()(views_, pipe, np.random.default_rng(0))
    kinds = [type(event) for event in told]
    assert kinds[0] is events.ReferenceChosen
    assert kinds.count(events.PairRegistered) == len(result.pairs)
    placed = [event for event in told if isinstance(event, events.ViewPlaced)]
    assert [event.name for event in placed] == list(result.poses)[1:]
    for event in placed:
        np.testing.assert_array_equal(event.T_model_scan, result.poses[event.name])
    assert placed[-1].model is result.model
