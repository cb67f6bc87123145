"""Turn the experiments' runs into Markdown tables and figures.

    python experiments/report.py

Run again on the same runs, it writes the same files.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pages import PAGES, Page
from printed import SOURCE
from runs import ROOT, Run, plan, runs
from sources import sources
from tables import gaps, jobs, table

RESULTS = Path(__file__).resolve().parent / "results"
IMAGES = (".svg", ".png")
#: What ``floor.py`` writes.
FLOOR = "floor.md"

LEGEND = """\
`false`: scans placed more than 5 degrees off the truth. e_R: mean Frobenius norm of the rotations'
errors, e_t: mean error of the translations, both in the frame of the reference scan, which counts
with zero; \\* where scans are missing from it. `time`: without loading. `consistency`: RMS
point-to-plane distance between the placed surfaces, in resolutions of the down-sampled scans, where
no truth is needed. `printed`: in the paper; `ratio`: ours to that."""


def main(root: Path = ROOT, out: Path = RESULTS, figures: bool = True) -> None:
    """Write a page for each experiment, a table of contents, and the figures.

    Parameters
    ----------
    root : Path
        The experiments' folders.
    out : Path
        Where to write.
    figures : bool
        Also draw the figures.
    """
    out.mkdir(parents=True, exist_ok=True)
    if figures:
        from figures import draw_all

        draw_all(root, out)
    contents = []
    for name, page in PAGES.items():
        found = runs(name, root)[: len(plan(name))]  # not those with overrides of one's own
        (out / f"{name}.md").write_text("\n".join(text(name, page, found, out)) + "\n", "utf-8")
        there = sum(run.report is not None for run in found)
        contents.append(f"| [{page.title}]({name}.md) | {there} of {len(found)} |")
        sys.stdout.write(f"{out / name}.md: {there} of {len(found)} jobs have a result\n")
    if (out / FLOOR).is_file():
        contents.append(f"| [How far the truth can be trusted]({FLOOR}) | |")
    (out / "README.md").write_text("\n".join(overview(contents)) + "\n", "utf-8")


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


def section(title: str, lines: Sequence[str]) -> list[str]:
    """A heading and what stands below it; nothing if that is nothing."""
    return ["", f"## {title}", "", *lines] if lines else []


def pictures(name: str, out: Path) -> list[str]:
    """The figures of an experiment: files whose name begins with its own."""
    files = [file for file in sorted(out.glob(f"{name}*")) if file.suffix in IMAGES]
    return [f"![{file.stem.replace('_', ' ')}]({file.name})" for file in files]


if __name__ == "__main__":
    main()
