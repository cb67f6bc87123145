"""Whether loops of hypotheses that close are right: what the default method joins by them.

    python -m experiments.accuracy.loops room office street desk lidar_campus --draws 5

Registers each data set in random orders, every scan moved at random, and lists for each set how
many agreements of pairs the search came across, by their certainty, and how many of them are right:
what `CHANCE`, `TOLERANCE` and `LEAST_CERTAIN` in ``mvreg/stages/strategy/best_first`` rest on. An
agreement is right if all its pairs are, within 5 degrees and 10 resolutions.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from rich.console import Console
from rich.table import Table

import mvreg
from mvreg.geometry import se3
from mvreg.stages.strategy.best_first import settlement
from mvreg.stages.strategy.best_first.agreement import Agreement, against
from mvreg.stages.strategy.best_first.hypotheses import Hypotheses
from mvreg.surface.displacement import rms_apart
from mvreg.types import Array

ANGLE, SHIFT = 5.0, 10.0
EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)


def is_right(agreement: Agreement, known: Hypotheses, truth: Mapping[str, Array]) -> bool:
    """Whether all the pairs of an agreement are right."""
    views = known.models.views
    for edge in (edge for bundle in agreement.bundles for edge in bundle.members):
        source, target = views[edge.source], views[edge.target]
        true = se3.invert(truth[target.name]) @ truth[source.name]
        apart = rms_apart(source.points, true, edge.T_target_source) / source.scale.resolution
        angle = np.rad2deg(se3.rotation_angle(true, edge.T_target_source))
        if angle > ANGLE or apart > SHIFT:
            return False
    return True


def agreements(name: str, draw: int, sensor: str) -> list[tuple[float, bool]]:
    """The certainty of every agreement of a run, and whether it is right."""
    scans = mvreg.dataset(name, rng=draw, order="shuffle", scramble=True, sensor=sensor)
    assert scans.poses is not None
    truth = scans.poses
    seen: dict[frozenset[int], tuple[float, bool]] = {}

    decide = settlement.Settlement.changed

    def watched(own: settlement.Settlement) -> bool:
        """Notes what is there to be decided."""
        new = decide(own)
        found = own.hypotheses.agreements() if new else []
        for one in found:
            certainty = one.odds / (1 + one.odds + against(one, found))
            key = frozenset(e.attempt for bundle in one.bundles for e in bundle.members)
            seen[key] = certainty, is_right(one, own.hypotheses, truth)
        return new

    setattr(settlement.Settlement, "changed", watched)  # noqa: B010, mypy knows no other method
    try:
        mvreg.register(scans, rng=draw)
    finally:
        setattr(settlement.Settlement, "changed", decide)  # noqa: B010
    return list(seen.values())


def main() -> None:
    """Print a row for each data set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("datasets", nargs="+")
    parser.add_argument("--draws", type=int, default=5)
    parser.add_argument("--sensor", default="auto")
    asked = parser.parse_args()
    bins = [f"{a:g} to {b:g}" for a, b in pairwise(EDGES)]
    table = Table("set", *bins, title="agreements by certainty: right of all")
    for name in asked.datasets:
        found = [one for draw in range(asked.draws) for one in agreements(name, draw, asked.sensor)]
        cells = []
        for low, high in pairwise(EDGES):
            inside = [right for p, right in found if low <= p < high or p == high == 1.0]
            cells.append(f"{sum(inside)} of {len(inside)}")
        table.add_row(name, *cells)
    Console().print(table)


if __name__ == "__main__":
    main()
