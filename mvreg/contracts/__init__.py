"""What a stage of each kind must do. A stage is a frozen dataclass: its fields are its parameters.

Stages are pure: no globals, no logging, no printing, and randomness only through `rng`. "No
candidate" is an empty `Candidates`, "found but doubtful" a `Verdict`; exceptions are for wrong
input. `mvreg.testing` has a contract suite for each kind. Records check themselves when they are
made, and a run checks every answer against what was asked: a stage that raises anything but an
`MvregError`, or answers what cannot be, ends the run with a `StageError` that names it. An
`InputError` is for whoever runs mvreg; out of a plugin's stage it comes with the stage in front.

What holds for all of them:

- Arrays are shared between records, may be read-only, and must not be written to.
- A view may have no point, one, or all in one place, and no keypoint; so may the model.
- Same arguments and same random numbers, same answer to the last bit, whatever the number of
  threads. Who calls several times with randomness spawns a generator per call from its own,
  in a fixed order: ``rng.spawn(1)[0]``.
- `describe` and `refine` are called from several threads at once. The order of the answers, and of
  the events, is that of the input.

A run emits, in this order: `RunStarted` (the command line only); a `ViewPrepared` per scan, in
their order; what the strategy makes of them; `AdjustStarted`; `RunFinished` (the command line
only). In the strategy's part a `PairStarted` is followed by its `PairRegistered`, and a pair that
is registered to check the first stands between the two; growing a model
begins with `ReferenceChosen` and has a `ViewPlaced` after each pair that is accepted. `Pipeline`
emits all of these but the first and the last two; a stage emits by its methods only.
"""

from __future__ import annotations

from mvreg.contracts.kinds import (
    Augment,
    Dataset,
    Describe,
    Downsample,
    JointJudge,
    Judge,
    Propagate,
    Refine,
    ScreeningJudge,
    Seed,
)
from mvreg.contracts.outer import Adjust, Strategy
from mvreg.contracts.pipeline import Pipeline, Task

__all__ = [
    "KINDS",
    "Adjust",
    "Augment",
    "Dataset",
    "Describe",
    "Downsample",
    "JointJudge",
    "Judge",
    "Pipeline",
    "Propagate",
    "Refine",
    "ScreeningJudge",
    "Seed",
    "Strategy",
    "Task",
]

KINDS: dict[str, type] = {
    "dataset": Dataset,
    "downsample": Downsample,
    "describe": Describe,
    "seed": Seed,
    "propagate": Propagate,
    "refine": Refine,
    "judge": Judge,
    "augment": Augment,
    "strategy": Strategy,
    "adjust": Adjust,
}
