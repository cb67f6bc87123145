"""The default method on kinds of sets that no weight was fitted to: recall, and honesty.

    python -m experiments.accuracy.kinds facade hall --draws 3

Sets in code, other ones for every draw: a facade and halls, scanned from tripods; a street,
scanned by a rotating LiDAR and by a solid-state one; a kitchen in fused fragments; a toy and a thin
tool; and scans of two places in one folder. Every scan is moved at random, the order is shuffled,
and no sensor is told. The name of any other data set does as well. Writes
``experiments/results/kinds.md`` where all kinds are run.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

import mvreg
from experiments.accuracy.kinds_fragments import Fragments
from experiments.accuracy.kinds_sites import Car, Facade, Hall, SolidState
from experiments.accuracy.kinds_things import Tool
from experiments.accuracy.placements import UNITS, Tolerance, Truth, judged
from mvreg.datasets.base import Order, ScanSource
from mvreg.datasets.environments.sets import Office, Room
from mvreg.datasets.mixture import join
from mvreg.datasets.synthetic import Figurine
from mvreg.types import Result, ScanSet

PAGE = Path(__file__).parents[1] / "results" / "kinds.md"
#: The first draw has this variant. Thresholds were chosen by looking at those from 100 to 102, and
#: how the sides of a thin tool are told apart on the tools from 200 to 202.
FIRST = 200
HEAD = """# Kinds of sets that no weight was fitted to

`python -m experiments.accuracy.kinds --draws {draws} --workers {workers}`, mvreg {version}.

Sets in code, other ones for every draw, see `experiments/accuracy/kinds.py`; every scan moved at
random, in random order, no sensor told. "In one model" are the scans placed correctly in the
largest model of their place, "in parts" those in any model. A model's scans that stand in a wrong
pose to the rest are false. Accepted pairs are those that the judge, or a loop, relied on; a wrong
one of them need not have placed a scan falsely. Seconds are those of the processor, a draw.
The judge's weights were fitted to other sets; some thresholds (`judge.min_probability_blind`, those
of loops and of the second look) were chosen on facades, halls, cars and fragments of other draws.

"""
COLUMNS = """\
| kind | scans | in one model | in parts | false | attempts a scan | s | pairs accepted | wrong | \
highest confidence of these |
|---|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Together(ScanSource):
    """The scans of several sets in one folder."""

    parts: tuple[ScanSource, ...] = ()
    name: str = "together"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Load them all."""
        return join([part.load(rng) for part in self.parts])


def _two(kind: type[ScanSource]) -> Callable[[int], ScanSource]:
    def parts(draw: int) -> ScanSource:
        return Together(parts=tuple(kind(variant=2 * draw + k) for k in (0, 1)))  # type: ignore[call-arg]

    return parts


#: What to scan, by the number of the draw.
KINDS: Mapping[str, Callable[[int], ScanSource]] = {
    "facade": lambda draw: Facade(variant=draw),
    "hall": lambda draw: Hall(variant=draw),
    "hall_alike": lambda draw: Hall(variant=draw, alike=True),
    "car": lambda draw: Car(variant=draw),
    "fragments": lambda draw: Fragments(variant=draw),
    "solid_state": lambda draw: SolidState(variant=draw),
    "toy": lambda draw: Figurine(views=5, points=20_000, shape=f"blob-{draw}", noise_rng=draw),
    "tool": lambda draw: Tool(variant=draw),
    "two_rooms": _two(Room),
    "two_halls": lambda draw: Together(
        parts=tuple(Hall(variant=2 * draw + k, scans=6) for k in (0, 1))
    ),
    "two_offices": _two(Office),
    "room_and_office": lambda draw: Together(parts=(Room(variant=draw), Office(variant=draw))),
}


@dataclass
class Count:
    """What came of some runs."""

    scans: int = 0
    together: int = 0
    right: int = 0
    false: int = 0
    attempts: int = 0
    seconds: float = 0.0
    accepted: int = 0
    wrong: int = 0
    highest: float = 0.0

    def row(self, kind: str, draws: int) -> str:
        """A row of the table."""
        highest = f"{self.highest:.3f}" if self.wrong else "-"
        return (
            f"| {kind} | {self.scans} | {self.together} | {self.right} | {self.false} | "
            f"{self.attempts / self.scans:.2f} | {self.seconds / draws:.1f} | {self.accepted} | "
            f"{self.wrong} | {highest} |"
        )


def together(counts: Sequence[Count]) -> Count:
    """The counts of several runs as one."""
    total = Count()
    for one in counts:
        for each in fields(Count):
            both = getattr(total, each.name), getattr(one, each.name)
            setattr(total, each.name, max(both) if each.name == "highest" else sum(both))
    return total


def scans_of(kind: str, draw: int) -> ScanSet:
    """The scans of a draw, as a folder of points has them."""
    if kind not in KINDS:
        return mvreg.dataset(kind, rng=draw, order="shuffle", scramble=True, sensor="unknown")
    source = KINDS[kind](FIRST + draw)
    source = replace(source, order=Order.shuffle, scramble=True, sensor="unknown")
    return source(np.random.default_rng(draw))


def add(count: Count, scans: ScanSet, found: Result, resolution: float) -> None:
    """Count what a run has placed, and where; `resolution` (length) is what errors are told in."""
    assert scans.poses is not None
    objects = scans.objects or dict.fromkeys(scans.poses, "")
    truth = Truth(scans.as_read(scans.poses), objects)
    unit = "m" if scans.unit not in UNITS else scans.unit
    tolerance = Tolerance.of({"unit": unit, "resolution": resolution})
    largest: dict[str, int] = {}
    for model in (found.poses, *found.components):
        if len(model) < 2:
            continue
        known = {name: T for name, T in scans.as_read(model).items() if name in truth.poses}
        good, bad = judged(known, truth, tolerance)
        count.right += len(good)
        count.false += len(bad)
        if good:
            shown = objects[good[0]]
            largest[shown] = max(largest.get(shown, 0), len(good))
    count.scans += len(scans.scans)
    count.together += sum(largest.values())
    count.attempts += len(found.pairs)
    for pair in found.pairs:
        pose = pair.T_target_source
        if (
            pose is not None
            and pair.verdict.reliable
            and {pair.source, pair.target} <= set(truth.poses)
        ):
            two = {pair.target: np.eye(4), pair.source: pose}
            count.accepted += 1
            if not truth.fits(pair.target, pair.source, scans.as_read(two), tolerance):
                count.wrong += 1
                count.highest = max(count.highest, pair.verdict.confidence or 0.0)


def measure(kind: str, draw: int) -> Count:
    """Register one draw of a kind."""
    scans, count = scans_of(kind, draw), Count()
    start = time.process_time()
    found = mvreg.register(scans, rng=draw)
    count.seconds += time.process_time() - start
    add(count, scans, found, found.views[0].scale.resolution)
    return count


def main() -> None:
    """Print a row for each kind; write the page of all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"{', '.join(KINDS)}, or a set")
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    print(COLUMNS, end="")
    rows = []
    with ProcessPoolExecutor(asked.workers) as pool:
        found = {
            kind: [pool.submit(measure, kind, draw) for draw in range(asked.draws)]
            for kind in asked.kinds or KINDS
        }
        for kind, counts in found.items():
            rows.append(together([one.result() for one in counts]).row(kind, asked.draws))
            print(rows[-1], flush=True)
    if not asked.kinds:
        head = HEAD.format(draws=asked.draws, workers=asked.workers, version=mvreg.__version__)
        PAGE.write_text(head + COLUMNS + "\n".join(rows) + "\n", "utf-8")


if __name__ == "__main__":
    main()
