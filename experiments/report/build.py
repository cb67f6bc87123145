"""Turn the experiments' runs into Markdown tables and figures.

    python -m experiments.report.build
    python -m experiments.report.build mixtures subsets

With names of pages, it writes these alone, and leaves the others as they are. Run again on the same
runs, it writes the same files.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from experiments.common.runs import ROOT, Run, planned
from experiments.common.sources import sources
from experiments.report import bench_page, outcomes
from experiments.report.pages import PAGES, Page
from experiments.report.printed import SOURCE
from experiments.report.robust_pages import ROBUST, RobustPage
from experiments.report.tables import gaps, jobs, table
from mvreg.errors import InputError

RESULTS = Path(__file__).resolve().parents[1] / "results"
IMAGES = (".svg", ".png")
#: What is made of the runs of ``bench.py``, where there are any.
BENCH = "bench.md"
FLOOR = "floor.md"
#: What is not made of runs: ``floor.py`` writes the third page, the others are written by hand.
KEPT = (
    ("Where the time goes", "profile.md"),
    ("Other systems on places, and POLAR", "other_systems.md"),
    ("How far the truth can be trusted", FLOOR),
    ("Large scans", "large.md"),
    ("Many scans", "many.md"),
    ("A cluster, simulated", "cluster.md"),
)

LEGEND = """\
`false`: scans placed more than 5 degrees off the truth. e_R: mean Frobenius norm of the rotations'
errors, e_t: mean error of the translations, both in the frame of the reference scan, which counts
with zero; \\* where scans are missing from it. `time`: without loading. `consistency`: RMS
point-to-plane distance between the placed surfaces, in resolutions of the down-sampled scans, where
no truth is needed. `printed`: in the paper; `ratio`: ours to that."""

ROBUST_LEGEND = """\
`correct`: scans within 2 degrees and 5 mm of the truth beside the others of their object, or within
3 resolutions of the down-sampled scans instead of the 5 mm where lengths are in metres; `false
positives`: scans in one frame with others, in a wrong relative pose or beside another object; `not
placed`: left over, or alone in a frame. Every partial model counts. `pairs / N`: pairs attempted
for each scan; e_R, e_t: mean errors in the frame of the reference scan; `time`: without loading; of
all these the median over the runs, \\* where scans are missing from an error. `confidence`: the
least and the greatest that the results state for scans placed correctly, and `of the false`."""


def main(
    root: Path = ROOT, out: Path = RESULTS, figures: bool = True, only: Collection[str] = ()
) -> None:
    """Write a page for each experiment, a table of contents, and the figures.

    Parameters
    ----------
    root : Path
        The experiments' folders.
    out : Path
        Where to write.
    figures : bool
        Also draw the figures.
    only : collection of str
        The pages to write; all if empty.

    Raises
    ------
    InputError
        If there is no such page; lists them.
    """
    names = [*PAGES, *ROBUST, Path(BENCH).stem]
    if unknown := sorted(set(only) - set(names)):
        raise InputError(f"no page {', '.join(unknown)}; there are: {', '.join(names)}")
    wanted = only or names
    out.mkdir(parents=True, exist_ok=True)
    if figures:
        from experiments.report.figures import draw_all

        draw_all(root, out)
    contents = []
    known = listed(out / "README.md")
    for name, page in PAGES.items():
        if name not in wanted:
            contents += known.get(name, [])
            continue
        found = planned(name, root)
        lines = text(name, page, found, out)
        contents.append(written(out / f"{name}.md", page.title, lines, found))
    for name, robust in ROBUST.items():
        if name not in wanted:
            contents += known.get(name, [])
            continue
        parts = {each: planned(each, root) for each in robust.experiments}
        lines = robust_text(name, robust, parts, out)
        found = [run for part in parts.values() for run in part]
        contents.append(written(out / f"{name}.md", robust.title, lines, found))
    bench = root.parent / "bench" / "bench.json"
    measured = bench_page.write(bench, out, figures) if Path(BENCH).stem in wanted else None
    if measured is not None:
        sys.stdout.write(f"{out / BENCH}: {measured} runs\n")
    if (out / BENCH).is_file():
        contents.append(f"| [{bench_page.TITLE}]({BENCH}) | |")
    contents += [f"| [{title}]({file}) | |" for title, file in KEPT if (out / file).is_file()]
    (out / "README.md").write_text("\n".join(overview(contents)) + "\n", "utf-8")


def written(file: Path, title: str, lines: Sequence[str], found: Sequence[Run]) -> str:
    """Write a page, and return its line in the table of contents."""
    file.write_text("\n".join(lines) + "\n", "utf-8")
    there = sum(run.report is not None for run in found)
    sys.stdout.write(f"{file}: {there} of {len(found)} jobs have a result\n")
    return f"| [{title}]({file.name}) | {there} of {len(found)} |"


def listed(contents: Path) -> dict[str, list[str]]:
    """The lines of a table of contents, by the names of their pages."""
    lines = contents.read_text("utf-8").splitlines() if contents.is_file() else []
    return {found[1]: [line] for line in lines if (found := re.search(r"\((\w+)\.md\) \|", line))}


def overview(contents: Sequence[str]) -> list[str]:
    """The page that leads to the others."""
    return [
        "# Results",
        "",
        f"Made by `make report`; the printed figures are those of {SOURCE}.",
        "[How to repeat it](../README.md).",
        "",
        "| experiment | jobs with a result |",
        "| --- | ---: |",
        *contents,
    ]


def text(name: str, page: Page, found: Sequence[Run], out: Path) -> list[str]:
    """The lines of one page."""
    rows = jobs(found, list(page.labels), page.base, page.printed)
    lines = [f"# {page.title}", "", page.text, "", f"`python -m mvreg -m +experiment={name}`", ""]
    lines += [*table(rows, page.labels, page.timed), "", LEGEND]
    if any(job.printed for job in rows) and (out / FLOOR).is_file():
        lines += [
            "",
            f"Below some errors they measure the truth, not the method: [{FLOOR}]({FLOOR}).",
        ]
    claims = [str(claim) for claim in page.check(found, page.printed)]
    if page.remarks and any("does not hold" in claim for claim in claims):
        claims += ["", page.remarks]
    lines += section("Claims", claims)
    lines += section("Without a result", gaps(rows))
    lines += section("Figures", pictures(name, out))
    return lines + section("Measured", sources(found))


def robust_text(
    name: str, page: RobustPage, parts: Mapping[str, Sequence[Run]], out: Path
) -> list[str]:
    """The lines of a page on robustness, whose runs are of one or several experiments."""
    found = outcomes.rows(parts, page.labels)
    lines = [f"# {page.title}", "", page.text, ""]
    lines += [f"- `python -m mvreg -m +experiment={each}`" for each in parts]
    heads = list(page.labels.values())
    shown = outcomes.table(found, page.experiments, heads, page.errors, page.timed)
    lines += ["", *shown, "", ROBUST_LEGEND]
    lines += section("Bars", page.bars(found))
    lines += section("Claims", [str(claim) for claim in page.check(found)])
    lines += section("False placements", outcomes.false_placements(found))
    lines += section("Without a result", outcomes.gaps(found))
    lines += section("Figures", pictures(name, out))
    return lines + section("Measured", sources([run for part in parts.values() for run in part]))


def section(title: str, lines: Sequence[str]) -> list[str]:
    """A heading and what stands below it; nothing if that is nothing."""
    return ["", f"## {title}", "", *lines] if lines else []


def pictures(name: str, out: Path) -> list[str]:
    """The figures of an experiment: files whose name begins with its own."""
    files = [file for file in sorted(out.glob(f"{name}*")) if file.suffix in IMAGES]
    return [f"![{file.stem.replace('_', ' ')}]({file.name})" for file in files]


if __name__ == "__main__":
    main(only=sys.argv[1:])
