"""The benchmarks as a page of the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from experiments.bench.plan import PARTS
from experiments.bench.records import Record, latest, load
from experiments.bench.show import tables
from experiments.bench.tables import Table, gaps
from experiments.common.runs import Run
from experiments.common.sources import sources
from experiments.report.bench_bars import bars
from experiments.report.bench_figures import draw
from mvreg.report.comparison.formats import markdown

TITLE = "How fast, and how the cost grows"
COMMAND = "make bench"
TEXT = """\
Every run is a process of its own; the methods take turns, each round led by another one. Time is
the registration alone, measured inside: imports and loading are over before, and what mvreg
prepares of the scans does not count for the peers, who do not use it. Median (least to most) of
the runs; ratios are of the medians. A peer's answers repeat, for which it is kept from some
threads; `+threads` is the same peer on all threads, as fast as it goes. `+joint` is the same method
with `adjust=joint`. Memory is the most that the process had resident at any time, imports and scans
included. A scan placed more than 5 degrees off the truth is `false`."""
ABOUT = {
    "methods": "Scans {order}.",
    "start": "Whole processes, with all that a run writes, the recording for rerun included.",
    "micro": "One function at a time, on one thread unless it says otherwise.",
    "scans": (
        "Scans of {points:,} points of one tall column, seen along a helix: each overlaps ten or "
        "so others, however many there are. They come in random order, each moved at random; poses "
        "are exact. Exponents are fitted to all sizes, and `at the end` between the largest two."
    ),
    "points": "{views} scans of the same column, from a finer mesh, with more and more points.",
}
STAGES = (
    "`other` is the strategy itself, and whatever no stage owns. Where stages run side by side "
    "they add up to more than the whole."
)
#: So many cores busy with something else make times doubtful.
BUSY = 0.15


def write(file: Path, out: Path, figures: bool) -> int | None:
    """Write ``bench.md`` and its figures; how many runs it tells of, None without any."""
    records = load(file)
    if not records:
        return None
    if figures:
        draw(records, out)
    (out / "bench.md").write_text("\n".join(page(records, out)) + "\n", "utf-8")
    return sum(len(latest(records, part)) for part in PARTS)


def page(records: Sequence[Record], out: Path) -> list[str]:
    """The lines of the page."""
    lines = [f"# {TITLE}", "", f"`{COMMAND}`", "", TEXT, *shown(bars(records))]
    for part in PARTS:
        own = latest(records, part)
        if not own:
            continue
        first, *others = tables(own, part)
        lines += [*shown(first, about(part, own)), *picture(out, part)]
        for other in others:
            lines += shown(other, STAGES if part == "methods" else "")
        if missing := gaps(own):
            lines += ["", "Without an answer:", "", *missing]
    told = [each for part in PARTS for each in latest(records, part)]
    return [*lines, "", "## Measured", "", *sources([run(each) for each in told]), *busy(told)]


def about(part: str, records: Sequence[Record]) -> str:
    """What a table is of."""
    spec = records[0].spec
    more = spec.get("parameters", {})
    order = "in random order, each moved at random" if more.get("order") else "in the files' order"
    return ABOUT[part].format(order=order, points=spec.get("points", 0), views=more.get("views", 0))


def shown(table: Table, text: str = "") -> list[str]:
    """A section with a table."""
    said = [text, ""] if text else []
    rows = markdown(table.heads, table.rows, table.left)
    return ["", f"## {table.title}", "", *said, *rows]


def picture(out: Path, part: str) -> list[str]:
    """The figure of a part, if there is one."""
    file = f"bench_{part}.png"
    return (
        ["", f"![{file.partition('.')[0].replace('_', ' ')}]({file})"]
        if (out / file).is_file()
        else []
    )


def run(record: Record) -> Run:
    """A record as the report's other pages know runs: where it comes from."""
    known = record.context
    report = {
        "finished": record.finished, "machine": known.machine, "commit": known.commit,
        "versions": known.versions,
    }  # fmt: skip
    return Run(Path(), (), report, None)


def busy(records: Sequence[Record]) -> list[str]:
    """What else the machine did meanwhile."""
    known = [r.others for r in records if r.others is not None]
    if not known:
        return []
    found = f"- Besides, {max(known):.2f} cores were busy with something else at the most"
    doubtful = sum(each > BUSY for each in known)
    note = f"; in {doubtful} of {len(known)} runs more than {BUSY}, so take times with care"
    return [found + (note if doubtful else "")]
