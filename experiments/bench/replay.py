"""A run of many scans made out of measured runs of fewer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, islice

import numpy as np

from experiments.bench.trace import Round, Trace

#: What the client does once in a run before its rounds, in every round, and once after them.
BEFORE, EACH, AFTER = (
    ("prepare", "scores"), ("choose", "keys", "answers", "learn"), ("withdraw", "adjust"),
)  # fmt: skip
#: What it does in all, as it grows with the scans.
CLIENT = (*BEFORE, *EACH, *AFTER)


@dataclass(frozen=True)
class Growth:
    """``factor * scans ** exponent`` seconds."""

    factor: float
    exponent: float

    def __call__(self, scans: int) -> float:
        return float(self.factor * scans**self.exponent)


def client_seconds(trace: Trace) -> dict[str, float]:
    """All that the client did in a run, by part."""
    found = {part: getattr(trace, part) for part in (*BEFORE, *AFTER)} | in_rounds(trace.rounds)
    return {part: found[part] for part in CLIENT}


def in_rounds(rounds: Sequence[Round]) -> dict[str, float]:
    """What the client did in some rounds, by part."""
    return {part: sum(getattr(one, part) for one in rounds) for part in EACH}


def growth(traces: Sequence[Trace]) -> dict[str, Growth]:
    """How each part grows: a power of the number of scans, by least squares of logarithms.

    Parameters
    ----------
    traces : sequence of Trace
        Of two sizes at least.
    """
    sizes = np.log([trace.scans for trace in traces])
    found = {}
    for part in CLIENT:
        seconds = [max(client_seconds(trace)[part], 1e-9) for trace in traces]
        exponent, factor = np.polyfit(sizes, np.log(seconds), 1)
        found[part] = Growth(float(np.exp(factor)), float(exponent))
    return found


def cost_of_members(trace: Trace) -> float:
    """Seconds that an attempt takes longer for each view of its two partial models; at least 0."""
    tasks = np.array([task for one in trace.rounds for task in one.tasks], dtype=float)
    if len(tasks) < 2 or np.ptp(tasks[:, 1]) == 0:
        return 0.0
    return max(0.0, float(np.polyfit(tasks[:, 1], tasks[:, 0], 1)[0]))


def replayed(trace: Trace, scans: int) -> list[Round]:
    """The rounds of a run of so many scans; of the client's work only its shares are of use.

    As if groups of scans, as many in each as were measured, were registered side by side, and then
    the models of the groups joined as so many scans would be: first every measured round, with as
    many attempts for each of its partial models, then once more those from where there were as many
    partial models as there are groups. These have as many more views in them, and take longer.

    Parameters
    ----------
    trace : Trace
        Of a run of fewer scans.
    scans : int

    Returns
    -------
    list of Round
    """
    groups = scans / trace.scans
    if groups <= 1:
        return trace.rounds
    last = [one for one in trace.rounds if one.models <= groups]
    slope = cost_of_members(trace)
    return [
        *(larger(one, groups) for one in trace.rounds),
        *(of_more_views(one, groups, slope) for one in last),
    ]


def larger(one: Round, times: float) -> Round:
    """A round of as many times the partial models, with attempts as they were, over and over."""
    tasks = list(islice(cycle(one.tasks), round(times * len(one.tasks))))
    client = {part: times * getattr(one, part) for part in EACH}
    return Round(round(times * one.models), **client, tasks=tasks)


def of_more_views(one: Round, times: float, slope: float) -> Round:
    """A round of partial models of as many times the views."""
    tasks = [
        (seconds + slope * (times - 1) * members, round(times * members))
        for seconds, members in one.tasks
    ]
    return replace(one, tasks=tasks)


def with_client(rounds: Sequence[Round], seconds: Mapping[str, float]) -> list[Round]:
    """The rounds, the client's work in them such that it sums up to so much by part."""
    factors = {
        part: seconds[part] / total if total else 0.0 for part, total in in_rounds(rounds).items()
    }
    return [
        replace(one, **{part: factor * getattr(one, part) for part, factor in factors.items()})
        for one in rounds
    ]
