"""The title, prose, columns and claims of each experiment's page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from experiments.common.runs import Run
from experiments.report import claims, printed
from experiments.report.checks import Claim
from experiments.report.printed import Printed

Check = Callable[[Sequence[Run], Callable[[Run], Printed | None]], list[Claim]]


def nothing(run: Run) -> Printed | None:
    """The paper gives no figures for this run."""
    return None


@dataclass(frozen=True)
class Page:
    """One experiment in the report.

    `labels` maps the overrides that distinguish its rows to column headings; rows are sorted by
    them. `base` identifies the run that times are relative to. Times are omitted where the
    parameter does not affect speed, so that such jobs can run in parallel. `remarks` explains why a
    claim may not hold.
    """

    title: str
    text: str
    labels: Mapping[str, str]
    base: Mapping[str, str]
    printed: Callable[[Run], Printed | None] = nothing
    check: Check = field(default=lambda runs, printed: [])
    timed: bool = True
    remarks: str = ""


def from_table(
    table: Mapping[tuple[str, str], Printed], key: str
) -> Callable[[Run], Printed | None]:
    """Look up a run in a table of the paper, by its value of `key` and its method."""
    return lambda run: table.get((run.value(key), run.value("method")))


BY_METHOD = {"dataset": "data set", "method": "method"}
FCPMA = {"method": "fcpma"}

#: Why the paper's claims about SurfC and SpanT may not hold.
WHY = (
    "Why some do not hold. SurfC takes the best N - 1 of all N(N - 1)/2 pairs, FCPMA the first "
    "reliable ones; and all methods share the same pair-wise registration here, whereas the "
    "paper's SurfC and SpanT use their own, with larger errors. The poses of the Dragon at which "
    "its scans fit best are 1.5 mm from the ground truth (floor.md), more than the error printed "
    "for SurfC. SpanT registers each pair in both directions, and failed pairs are the slowest."
)

#: Where the Armadillo's scans are missing.
VIRTUAL = "Virtual scans of the Armadillo's reconstruction have [a page of their own](virtual.md)."

PAGES = {
    "table1": Page(
        "Table 1: the paper's three methods",
        f"Scans in file order. `time ratio`: relative to FCPMA's time. {VIRTUAL}",
        BY_METHOD, FCPMA, from_table(printed.TABLE1, "dataset"), claims.table1,
    ),
    "table2": Page(
        "Table 2: against SurfC and SpanT",
        "Scans in file order. SurfC and SpanT are reimplemented as far as they are published; "
        "`plugins/mvreg-comparators` lists what had to be assumed. All three use the same "
        "pair-wise registration. `time ratio`: relative to FCPMA's time. Fig. 9 cuts every result "
        "with the same slab, one resolution thick, one colour per scan; below, enlarged, the "
        f"region where the scans of the worst result disagree most. {VIRTUAL}",
        BY_METHOD, FCPMA, from_table(printed.TABLE2, "dataset"), claims.table2, remarks=WHY,
    ),
    "virtual": Page(
        "Virtual scans of the Armadillo",
        "Virtual scans of the reconstruction, 30 degrees apart, with exact poses, in file order. "
        "They are not the scans of the paper's Tables 1 and 2, so that no printed figures "
        "compare with these. `time ratio`: relative to FCPMA's time.",
        BY_METHOD, FCPMA, check=claims.peers,
    ),
    "table3": Page(
        "Table 3: the Bunny in five orders",
        "Five random orders (`dataset.order=shuffle rng=1` to `5`). The paper does not say which "
        "orders it used, so only the spread over the orders compares with it, no single row. "
        "`time ratio`: relative to FCPMA's time.",
        {"rng": "order", "method": "method"}, FCPMA, from_table(printed.TABLE3, "rng"),
        claims.table3, remarks=WHY,
    ),
    "peers": Page(
        "Comparison with other systems",
        "Scans in random order and random poses (`dataset.order=shuffle dataset.scramble=true "
        "rng=1`). `time ratio`: relative to FCPMA's time. "
        "Places, and POLAR: [other_systems.md](other_systems.md).",
        BY_METHOD, FCPMA, check=claims.peers,
    ),
    "delta": Page(
        "The fraction of seed matches that is propagated: delta",
        "The Bunny with FCPMA, whose delta is 0.3. `time ratio`: relative to its time.",
        {"seed.top_fraction": "delta"}, {"seed.top_fraction": "0.3"},
    ),
    "scales": Page(
        "The number of scales of a descriptor: L",
        "The Bunny with FCPMA, whose L is 4.",
        {"describe.scales": "L"}, {"describe.scales": "4"}, timed=False,
    ),
    "tmse": Page(
        "The threshold of the trimmed MSE",
        "FCPMA with different factors of d_Q in Eq. (7); the paper uses 2. `tmse` is Eq. (7) "
        "alone; `tmse_surface`, used by FCPMA, also tests the surfaces. The ROC curves are "
        "over all ordered pairs of raw scans; a registration counts as correct if it is within 5 "
        "degrees and 5 resolutions of the ground truth and the scans overlap by 5 % or more.",
        {"dataset": "data set", "judge": "judge", "judge.resolution_factor": "factor"},
        {"judge": "tmse_surface", "judge.resolution_factor": "2.0"}, timed=False,
    ),
    "overlap": Page(
        "Overlap",
        "The figurine with FCPMA, scanned from that many viewpoints all around. `overlap` is the "
        "mean fraction of a scan's points kept by trimming.",
        {"dataset.views": "views"}, {"dataset.views": "12"}, timed=False,
    ),
    "noise": Page(
        "Noise",
        "The figurine with FCPMA. Noise is the standard deviation of the range, 0.08 mm by "
        "default; the point spacing is 0.56 mm.",
        {"dataset.noise": "noise (mm)"}, {"dataset.noise": "0.08"}, timed=False,
    ),
    "sampling": Page(
        "Sampling",
        "The Bunny with FCPMA, which by default refines on one point in 10 and describes one in "
        "100. `time ratio`: relative to the time with these defaults.",
        {"downsample.stride": "refined on one in", "downsample.keypoint_ratio": "described one in"},
        {"downsample.stride": "10", "downsample.keypoint_ratio": "100"},
    ),
}  # fmt: skip
