"""The simulated cluster: its clock, what it is made of, and the rounds of more scans."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.bench import cluster as command
from experiments.bench import many
from experiments.bench.replay import (
    CLIENT,
    client_seconds,
    cost_of_members,
    growth,
    replayed,
    with_client,
)
from experiments.bench.run import main as bench
from experiments.bench.simulated import ALONE, WORKERS, Cluster, simulated
from experiments.bench.trace import Round, Trace, kept
from mvreg.store.content import versions

NOTHING = {"prepare": 0.0, "scores": 0.0, "withdraw": 0.0, "adjust": 0.0}


def flat(
    models: int, tasks: int, seconds: float = 1.0, members: int = 2, client: float = 0.0
) -> Round:
    return Round(models, client, client, client, client, [(seconds, members)] * tasks)


def trace(scans: int, client: float = 1.0) -> Trace:
    """Halved in every round, by half as many attempts as there are models."""
    rounds, models = [], scans
    while models > 1:
        rounds.append(flat(models, models // 2, 1.0 + scans / models, 2 * scans // models, client))
        models //= 2
    return Trace(scans, scans, client * scans, client, client, client * scans**2, 0.01, rounds)


def test_workers_share_what_they_can() -> None:
    for workers, seconds in ((1, 64), (4, 16), (64, 1), (100, 1)):
        found = simulated([flat(128, 64)], NOTHING, workers, 128, 0.0, scheduler=0.0)
        assert found.clock == pytest.approx(seconds)
        assert found.worked == pytest.approx(64)
        assert found.path[WORKERS] == pytest.approx(found.clock)


def test_the_parts_of_the_path_are_all_of_it() -> None:
    client = dict.fromkeys(NOTHING, 2.0)
    rounds = [flat(9, 5, 1.0, 3, 0.5), flat(4, 1, 3.0, 5, 0.25), flat(3, 2, 2.0, 6, 0.125)]
    found = simulated(rounds, client, 2, 9, 0.1)
    assert sum(found.path.values()) == pytest.approx(found.clock)
    assert found.path["choose"] == pytest.approx(0.875)
    assert found.path["answers"] == pytest.approx(0.875)
    assert found.path[ALONE] == 3.0
    assert [count for count, _, _ in found.rounds] == [5, 1, 2]
    assert found.rounds[1][1:] == (4.0, 3.0)
    assert sum(spent for _, spent, _ in found.rounds) == pytest.approx(found.clock - 8.0)
    assert all(found.path[part] == 2.0 for part in client)


def test_the_scheduler_sends_one_tile_after_the_other() -> None:
    found = simulated([flat(20, 10, 0.0)], NOTHING, 10, 20, 0.0, scheduler=0.5)
    assert found.clock == pytest.approx(5.0)  # ten tiles of one task


def test_the_client_learns_while_others_work() -> None:
    one = replace(flat(8, 4), learn=4.0)
    # One worker: answers at 1, 2, 3, 4 s, each of which takes the client another second.
    assert simulated([one], NOTHING, 1, 8, 0.0, scheduler=0.0).clock == pytest.approx(5.0)


def test_that_each_worker_reads_a_view_once() -> None:
    cluster = Cluster(1, 10, 1.0, 0.0)
    cluster.round(flat(10, 200, 0.0, 5))
    assert cluster.worked == pytest.approx(10.0, rel=1e-6)
    first = Cluster(1, 10, 1.0, 0.0)
    assert first.took(0, 0.0, 5) == 5.0 and first.took(0, 0.0, 4) == 2.0


def test_that_scans_may_be_prepared_by_workers() -> None:
    client = NOTHING | {"prepare": 100.0}
    assert simulated([], client, 10, 100, 0.0, scheduler=0.0).clock == pytest.approx(100.0)
    found = simulated([], client, 10, 100, 0.0, scheduler=0.0, prepared=True)
    assert found.clock == pytest.approx(10.0)


def test_growth_is_what_it_is() -> None:
    found = growth([trace(16), trace(32), trace(64)])
    assert found["prepare"].exponent == pytest.approx(1.0)
    assert found["adjust"].exponent == pytest.approx(2.0)
    assert found["scores"].exponent == pytest.approx(0.0, abs=1e-9)
    assert found["adjust"](1000) == pytest.approx(1e6)
    assert set(client_seconds(trace(16))) == set(CLIENT)


def test_the_rounds_of_more_scans() -> None:
    one = trace(16)
    assert replayed(one, 16) == one.rounds
    found = replayed(one, 64)
    assert [each.models for each in found] == [64, 32, 16, 8, 4, 2]
    assert [len(each.tasks) for each in found] == [32, 16, 8, 4, 2, 1]
    assert found[-1].tasks[0][1] == 4 * one.rounds[-1].tasks[0][1]
    # An attempt takes half a second more for each member.
    assert cost_of_members(one) == pytest.approx(0.5)
    assert found[-1].tasks[0][0] == pytest.approx(1 + 64 / 2)
    shared = with_client(found, dict.fromkeys(("choose", "keys", "answers", "learn"), 7.0))
    assert sum(each.learn for each in shared) == pytest.approx(7.0)
    assert [each.tasks for each in shared] == [each.tasks for each in found]


def test_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = command.page([trace(16, 1e-3), trace(32, 1e-3)], 256, 8, 1e-3)
    assert "8 rounds, 255 attempts." in text
    assert "| more than 31 |" in text and "| 1 to 7 |" not in text
    assert "| 8 workers |" in text and "| waiting for the workers |" in text
    again = command.page([trace(16, 1e-3), trace(32, 1e-3)], 256, 8, 1e-3)
    assert again == text


@pytest.mark.slow
def test_a_measured_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.bench.many.SCANS", tmp_path / "scans")
    found = kept(5, tmp_path)
    assert found.placed == 5 and found.rounds[0].models == 5
    assert sum(len(one.tasks) for one in found.rounds) >= 4
    assert all(seconds > 0 for one in found.rounds for seconds, _ in one.tasks)
    assert min(client_seconds(found).values()) > 0 and found.read > 0
    file = tmp_path / f"trace_5_{versions()[:12]}.json"
    changed = json.loads(file.read_text()) | {"placed": 77}
    file.write_text(json.dumps(changed))
    assert kept(5, tmp_path).placed == 77  # not measured again


def test_many_scans_are_measured_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["many", "--cases", "around-3", "--file", str(tmp_path / "bench.json")]
    assert bench(words) == 0
    assert "| around-3 | 3 of 3 | 0 |" in capsys.readouterr().out
    assert bench(words) == 0
    assert "many around-3: kept from before" in capsys.readouterr().out
    assert bench([*words[:2], "around-4", *words[3:], "--limit", "0.01"]) == 0
    assert "longer than 0.01 s" in capsys.readouterr().out
    assert len([*(tmp_path / "many").iterdir()]) == 1
    assert bench([*words[:2], "around-nothing", *words[3:]]) == 0
    assert "failed, 1" in capsys.readouterr().out


def test_cases_that_find_no_time_are_left_to_the_next_call(tmp_path: Path) -> None:
    lines = many.table(["around-3", "around-4"], tmp_path, within=0.0)
    assert "".join(lines).count("not measured yet") == 2 and not [*tmp_path.iterdir()]
    assert many.least(5.0, None) == 5.0 and many.least(None, None) is None
    assert many.least(1e9, time.monotonic() + 5) <= 5
