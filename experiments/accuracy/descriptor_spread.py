"""The spread of each kind of descriptor, and the sensitivity to the matching tolerance.

    python -m experiments.accuracy.descriptor_spread tiny figurine bunny dragon buddha

For every data set and ``describe`` stage that finds descriptors: the spread over all scans, see
`mvreg.types.estimated_spread`, and scan by scan; and how many scans the default method places,
and in how many attempts, with tolerances of half to twice the spread. `SPREAD` in
``mvreg/stages/describe/spectrum.py`` and ``propagate.descriptor_tolerance`` come from it. Writes
``experiments/results/descriptor_spread.md``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rich.progress import track

import mvreg
from mvreg.evaluation.pose_errors import pose_errors
from mvreg.plugins import manager
from mvreg.types import ScanSet, View, estimated_spread

RESULTS = Path(__file__).parents[1] / "results" / "descriptor_spread.md"
#: In units of the spread.
TOLERANCES = (0.5, 1.0, 2.0)
#: A scan is placed wrongly that is off the data set's own pose by more degrees than this.
WRONG = 5.0

HEAD = """# The spread of descriptors

`python -m experiments.accuracy.descriptor_spread {names}`, mvreg {version}, {date}.

The spread is the radius of the ball about the component-wise median that contains three quarters
of the descriptors. "Over all" is computed from the descriptors of all scans together, "scan by
scan" from each scan alone, as it is estimated where a stage declares no spread. The last columns
give the number of scans that the default method places with that stage, and of pairs attempted, for
each tolerance on the descriptors (in spreads). {wrong}

| scans | describe | over all | scan by scan | declared | {columns} |
|---|---|---|---|---|{rule}|
"""


def views_of(scans: ScanSet, describe: str) -> list[View]:
    """The prepared scans of a set."""
    pipeline = mvreg.load_method("auto", {"describe": describe}).pipeline
    return pipeline.prepare(scans.scans, np.random.default_rng(0))


def placed(scans: ScanSet, describe: str, tolerance: float) -> tuple[str, int]:
    """How many scans are placed and after how many attempts, and how many of them wrongly."""
    changes = {"describe": describe, "propagate.descriptor_tolerance": tolerance}
    result = mvreg.register(scans, changes=changes)
    errors = pose_errors(result.poses, scans.poses, result.reference)
    wrong = 0 if errors is None else sum(one.angle > WRONG for one in errors.scans.values())
    return f"{len(result.poses)} of {len(scans.scans)}, {len(result.pairs)}", wrong


def measure(name: str, describe: str) -> tuple[str, int] | None:
    """The row of the table, and the scans placed wrongly; None without descriptors."""
    scans = mvreg.dataset(name)
    features = [view.features for view in views_of(scans, describe)]
    together = np.concatenate([one.descriptors for one in features])
    if not len(together):
        return None
    each = [estimated_spread(one.descriptors) for one in features]
    declared = "" if features[0].spread is None else f"{features[0].spread:g}"
    found = [placed(scans, describe, tolerance) for tolerance in TOLERANCES]
    cells = " | ".join(cell for cell, _ in found)
    row = (
        f"| {name} | {describe} | {estimated_spread(together):.3f} | "
        f"{min(each):.3f} to {max(each):.3f} | {declared} | {cells} |"
    )
    return row, sum(wrong for _, wrong in found)


def measured(names: list[str]) -> Iterator[tuple[str, int]]:
    """A row for each data set and describe stage, stage by stage."""
    stages = [stage.name for stage in manager.stages().values() if stage.kind == "describe"]
    for describe, name in track([(d, n) for d in stages for n in names]):
        if (found := measure(name, describe)) is not None:
            yield found


def main(names: list[str]) -> None:
    """Print the table, and keep it."""
    rows, wrong = zip(*measured(names), strict=True)
    worst = f"{sum(wrong)} scans were" if sum(wrong) else "None was"
    head = HEAD.format(
        names=" ".join(names),
        version=version("mvreg"),
        date=date.today(),
        wrong=f"{worst} placed wrongly, by more than {WRONG:g} degrees.",
        columns=" | ".join(f"{tolerance:g}" for tolerance in TOLERANCES),
        rule="|".join("---" for _ in TOLERANCES),
    )
    RESULTS.write_text(head + "\n".join(rows) + "\n")
    print("\n".join(rows))


if __name__ == "__main__":
    main(sys.argv[1:] or ["tiny", "figurine"])
