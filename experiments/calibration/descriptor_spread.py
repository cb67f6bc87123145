"""How far apart the descriptors of unlike keypoints are: the unit of their tolerances.

For each `describe` stage and data set, `Features.spread` as it is estimated from a view's own
descriptors, the median distance between two of them: least, median and largest over the views. What
the stages declare comes from here.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

import mvreg
from mvreg.plugins import manager
from mvreg.types import Features
from mvreg.types.view import typical_distance

#: Where no data sets are named.
GENERATED = ("tiny", "figurine")


def described(dataset: str, stage: str) -> list[Features]:
    """The features of all the views of a data set, prepared as by the default method."""
    method = mvreg.load_method("auto", {"describe": stage})
    views = method.pipeline.prepare(mvreg.dataset(dataset).scans, np.random.default_rng(1))
    return [view.features for view in views if len(view.features.keypoints)]


def stages() -> list[str]:
    """The names of the `describe` stages that are installed."""
    return [stage.name for stage in manager.stages().values() if stage.kind == "describe"]


def main(names: Sequence[str]) -> None:
    """Print a table of the given data sets."""
    made = Table("descriptor", "data set", "least", "median", "largest", "declared")
    for stage in stages():
        for name in names:
            features = described(name, stage)
            if features:
                found = [typical_distance(view.descriptors) for view in features]
                numbers = [f"{value:.2f}" for value in np.percentile(found, [0, 50, 100])]
                made.add_row(stage, name, *numbers, str(features[0].declared_spread))
    Console().print(made)


if __name__ == "__main__":
    main(sys.argv[1:] or GENERATED)
