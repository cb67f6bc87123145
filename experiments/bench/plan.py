"""The cases of a benchmark, and the order in which they run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
#: mvreg's own methods, and what else one might take; as it comes, and on all threads.
OWN = ("fcpma", "fcpma+joint", "auto", "ocpma", "ocpra")
PEERS = ("open3d_multiway", "kiss_gicp", "open3d_multiway+threads", "kiss_gicp+threads")
#: Those whose growth is measured.
GROWING = ("fcpma", "auto", "ocpma", "ocpra")
DATASETS = ("bunny", "dragon", "buddha")
SIZES = (10, 20, 40, 80, 160, 300)
POINTS = (10_000, 30_000, 100_000, 300_000, 1_000_000)
PARTS = ("methods", "start", "micro", "scans", "points")
#: Edges of the column's mesh (mm): one that its points do not see the facets of.
STEP, FINE_STEP, FINE_FROM = 1.0, 0.4, 30_000
#: What growth is measured on: scans in random order, each moved at random.
UNORDERED = {"order": "shuffle", "scramble": True}
#: Whole commands, from the start to the prompt.
COMMANDS = {
    "run": ("python -m mvreg +method=fcpma dataset=bunny", ("+method=fcpma", "dataset=bunny")),
    "help": ("python -m mvreg --help", ("--help",)),
}


@dataclass(frozen=True)
class Options:
    """What the command line asks for; see ``python -m experiments.bench.run --help``."""

    parts: Sequence[str] = PARTS
    methods: Sequence[str] = (
        "fcpma", "fcpma+joint", "auto", "open3d_multiway", "kiss_gicp", "kiss_gicp+threads",
    )  # fmt: skip
    datasets: Sequence[str] = DATASETS
    peers_on: Sequence[str] = ("bunny",)
    rounds: int = 3
    growth_rounds: int = 1
    sizes: Sequence[int] = SIZES
    points: Sequence[int] = POINTS
    scan_points: int = 10_000
    scan_count: int = 10
    shuffle: bool = False
    scans: Path = Path("runs/bench/scans")


@dataclass(frozen=True, eq=False)
class Case:
    """Something to be measured: `spec` is what a child process is told, or a command's words.

    `group` are measured in turn; a `size` that took too long rules out the larger ones of the
    same `row`.
    """

    part: str
    row: str
    group: str
    spec: Mapping[str, Any] = field(default_factory=dict)
    size: int = 0
    #: Which files of the column are asked for: how many, with how many points, from which mesh.
    column: tuple[Path, int, int, float] | None = None

    @property
    def key(self) -> str:
        """What tells it from other cases, whatever folder the scans are kept in."""
        more = {k: v for k, v in dict(self.spec.get("parameters", {})).items() if k != "folder"}
        return json.dumps(
            [self.part, self.row, self.group, self.size, {**self.spec, "parameters": more}],
            sort_keys=True,
        )


def plan(options: Options) -> Iterator[tuple[Case, int]]:
    """Every case with the number of its round, in the order in which they are to be run."""
    rounds = {"methods": options.rounds, "start": options.rounds, "micro": 1}
    for part in options.parts:
        for group in GROUPS[part](options):
            for case, number in turns(group, rounds.get(part, options.growth_rounds)):
                yield (case if part in rounds else redrawn(case, number)), number


def redrawn(case: Case, number: int) -> Case:
    """The case in a round of its own: other orders and motions, which the pairs depend on."""
    return replace(case, spec={**case.spec, "rng": case.spec["rng"] + number})


def turns(group: Sequence[Case], rounds: int) -> Iterator[tuple[Case, int]]:
    """Round by round, each one led by another case."""
    for number in range(rounds):
        first = number % max(len(group), 1)
        yield from ((case, number) for case in (*group[first:], *group[:first]))


def methods(options: Options) -> list[list[Case]]:
    """A group for each data set."""
    parameters = UNORDERED if options.shuffle else {}
    return [
        [
            Case("methods", method, dataset,
                 {"method": method, "dataset": dataset, "rng": 1, "parameters": parameters})
            for method in options.methods
            if method not in PEERS or dataset in options.peers_on
        ]
        for dataset in options.datasets
    ]  # fmt: skip


def start(options: Options) -> list[list[Case]]:
    """The commands."""
    found = [Case("start", text, name, {"words": list(w)}) for name, (text, w) in COMMANDS.items()]
    return [found]


def micro(options: Options) -> list[list[Case]]:
    """All micro-benchmarks, which repeat themselves."""
    return [[Case("micro", "kernels", "all")]]


def scans(options: Options) -> list[list[Case]]:
    """A group for each number of scans."""
    return [
        [on_column("scans", method, size, size, options.scan_points, options) for method in own]
        for size in sorted(options.sizes)
        if (own := [m for m in options.methods if m in GROWING])
    ]


def points(options: Options) -> list[list[Case]]:
    """A group for each number of points per scan."""
    return [
        [on_column("points", method, size, options.scan_count, size, options) for method in own]
        for size in sorted(options.points)
        if (own := [m for m in options.methods if m in GROWING])
    ]


def on_column(part: str, method: str, size: int, views: int, points: int, options: Options) -> Case:
    """A case on scans of the column."""
    # All sizes of a part see the same mesh.
    most = max(options.points) if part == "points" else points
    step = FINE_STEP if most > FINE_FROM else STEP
    folder = options.scans / f"column_{points}_{step:g}_{edition()}"
    parameters = {"folder": str(folder), "views": views, **UNORDERED}
    spec = {"method": method, "dataset": "column", "rng": 1, "parameters": parameters,
            "points": points, "step": step}  # fmt: skip
    return Case(part, method, str(size), spec, size, (folder, views, points, step))


def edition() -> str:
    """A name for the column as its code makes it now; scans of another one must not be mixed in."""
    code = [(HERE / name).read_bytes() for name in ("column.py", "relief.py")]
    return hashlib.sha256(b"".join(code)).hexdigest()[:8]


GROUPS = {"methods": methods, "start": start, "micro": micro, "scans": scans, "points": points}
