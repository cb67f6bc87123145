"""The page on the calibration of the judge by evidence."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.calibration.fit import RIGHT
from experiments.calibration.roc import area

if TYPE_CHECKING:
    from experiments.calibration.calibrate import Judged

HEAD = """# The judge by evidence, calibrated

`python -m experiments.calibration.calibrate`, mvreg {version}, {date}.

Correct and wrong poses of pairs of scans: the best pose, its alternatives and its symmetries as the
default method finds them, all refined; correct poses displaced by 4, 8 and 20 resolutions along the
directions in which the overlap slides most easily, as they are and refined again; and, where the
search missed the true pose, that pose refined. A pose is correct within 2 degrees and 5 mm of the
ground truth, or 3 resolutions where lengths are in metres. In a group "a+b" scans of different
objects or scenes are registered with each other, so that all poses are wrong; "~noise" has added
noise of one mean spacing along every axis. Probabilities are cross-validated: their weights are
fitted to poses of other kinds of scene and sensor, where office and tls_office are of one kind, and
so are street and lidar_campus, desk and rgbd_desk. Every kind counts the same, with {right:.0%} of
right poses: that is about the share among the best poses of attempts, of which the reliability
diagram is, too. Poses that are off by less than half more than a correct one may be are left out.
With "estimated" the pairs are left out of which no scan tells its sensor; with "none" normals have
no orientation.

AUC is the area under the ROC curve; "right accepted" and "wrong accepted" are at the judge's
threshold, {threshold:g}; "median" is the probability of the right ones, "highest" that of the most
probable wrong one. The probability is 0 where scans hardly overlap, and where the overlap can
slide along itself.

The weights in use are those fitted to all kinds, but for "none". There they are those that had been
fitted to objects alone, and the judge asks for 0.998: fitted to all kinds they make right poses of
a campus less probable, so that fewer of them agree in loops.

"""
TITLES = ("By kind, cross-validated", "By group, cross-validated", "With the weights in use")
COLUMNS = """\
| sensors | of | poses | right | AUC | right accepted | median | wrong accepted | highest |
|---|---|---|---|---|---|---|---|---|"""


def line(setting: str, name: str, judged: Judged, threshold: float) -> str:
    """A row of the table."""
    right, chances = judged.right, judged.chances
    some = right.any() and not right.all()
    median = f"{np.median(chances[right]):.2f}" if right.any() else "-"
    auc = f"{area(-chances, right):.4f}" if some else "-"
    taken = f"{(chances[right] >= threshold).mean():.1%}" if right.any() else "-"
    wrong = chances[~right]
    most = f"{wrong.max():.3f}" if len(wrong) else "-"
    return (
        f"| {setting} | {name} | {len(right)} | {right.sum()} | {auc} | {taken} | {median} | "
        f"{(wrong >= threshold).sum()} | {most} |"
    )


def write(file: Path, parts: Sequence[Sequence[str]], threshold: float) -> None:
    """Write the page: tables by kind, by group, and with the weights in use."""
    head = HEAD.format(
        version=version("mvreg"), date=date.today(), threshold=threshold, right=RIGHT
    )
    page = [head]
    for title, part in zip(TITLES, parts, strict=True):
        page += [f"## {title}\n", COLUMNS, *part, ""]
    file.write_text("\n".join(page), "utf-8")
