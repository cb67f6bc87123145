"""Pages on robustness: runs of one or several experiments, evaluated scan by scan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from experiments.report.checks import Case, Claim
from experiments.report.goals import GOALS, ORDERS
from experiments.report.outcomes import Row
from experiments.report.tables import number
from mvreg.report.comparison.formats import markdown


@dataclass(frozen=True)
class RobustPage:
    """A page on robustness.

    `experiments` maps each experiment to its caption, `labels` the overrides that distinguish rows
    to column headings; runs that agree in all of them share a row. `errors` says whether pose
    errors are meaningful, `timed` whether times are shown; `bars` adds a section of targets,
    `check` the claims.
    """

    title: str
    text: str
    experiments: Mapping[str, str]
    labels: Mapping[str, str]
    check: Callable[[Sequence[Row]], list[Claim]]
    errors: bool = True
    timed: bool = False
    bars: Callable[[Sequence[Row]], list[str]] = field(default=lambda rows: [])


def none_false(rows: Sequence[Row]) -> list[Claim]:
    """No scan is a false positive."""
    return [Claim("no scan is a false positive", none_of(rows, ["false"]))]


def none_placed(rows: Sequence[Row]) -> list[Claim]:
    """No scan is placed at all."""
    return [Claim("no scan is placed", none_of(rows, ["right", "false"]))]


def foreign_reported(rows: Sequence[Row]) -> list[Claim]:
    """There is no false positive, and a single foreign scan is never placed.

    As the only scan of its object it is either a false positive or not placed.
    """
    alone = [row for row in rows if row.values[1] == ONE_FOREIGN]
    found = none_of(alone, ["false"])
    return [*none_false(rows), Claim("one foreign scan is never placed", found)]


#: The value of `dataset.keep` that adds a single foreign scan.
ONE_FOREIGN = "[all,1]"


def none_of(rows: Sequence[Row], kinds: Sequence[str]) -> dict[str, Case]:
    """Check per experiment that no scan has any of these outcomes."""
    cases: dict[str, Case] = {}
    for name in dict.fromkeys(row.experiment for row in rows):
        own = [row for row in rows if row.experiment == name]
        known, total = sum(len(row.known) for row in own), sum(len(row.outcomes) for row in own)
        count = sum(row.count(kind) for row in own for kind in kinds)
        cases[name] = (count == 0, f"{count} in {known} of {total} runs") if known else None
    return cases


def bars(rows: Sequence[Row]) -> list[str]:
    """The targets over all orders, and whether they were met."""
    lines = []
    for row in rows:
        if (goal := GOALS.get(row.values[0])) is None:
            continue
        wanted, right = ORDERS * goal.scans, row.count("right")
        rotation = row.median(lambda each: each.now.rotation)
        shift = row.median(lambda each: each.now.translation)
        pairs = row.median(lambda each: each.pairs_per_scan)
        measures: list[tuple[str, float, float, bool, str]] = [
            ("scans placed correctly", right, wanted, right >= wanted, ".0f"),
            ("median e_R", rotation, goal.rotation, rotation <= goal.rotation, ".4f"),
            ("median e_t (mm)", shift, goal.translation, shift <= goal.translation, ".3f"),
            ("median pairs / N", pairs, goal.pairs, pairs <= goal.pairs, ".2f"),
        ]
        for name, value, bar, reached, form in measures:
            ours = number(value, form) if row.known else ""
            verdict = "not all run" if len(row.known) < ORDERS else "yes" if reached else "**no**"
            lines.append((row.values[0], name, ours, f"{bar:{form}}", verdict))
    return markdown(("data set", "", "ours", "bar", "reached"), lines, 2)


SETS = {"dataset": "data set"}
ROBUST = {
    "orders": RobustPage(
        "Unordered scans in 20 orders",
        "The default method on scans in random order and random poses.",
        {"orders": ""}, SETS, none_false, bars=bars,
    ),
    "folders": RobustPage(
        "Folders of points",
        "The scans as most people have them: in random order, each moved at random, and nothing "
        "known of where the sensor was, in 20 orders. armadillo_virtual are virtual scans of the "
        "Armadillo's reconstruction, with exact poses.",
        {"folders": ""}, SETS, none_false, timed=True,
    ),
    "environments": RobustPage(
        "Rooms, streets and desks",
        "Places instead of things, every scan moved at random, 10 times each. The first five are "
        "modelled in code, with exact poses; the others are recorded, by an RGB-D camera "
        "(rgbd_desk), a rotating LiDAR (lidar_campus) and a tilting 2D laser (tls_office). The "
        "truth of these is good to a few centimetres, so that errors are not shown. Times beside "
        "KISS-Matcher's: [other_systems.md](other_systems.md).",
        {"environments": ""}, SETS, none_false, errors=False, timed=True,
    ),
    "mixtures": RobustPage(
        "Mixed scans of several objects",
        "All scans of two objects; fifty random mixtures of two or three objects, each with a "
        "fifth to all of its scans; and one or three foreign scans added to a complete set.",
        {
            "mixtures_pairs": "two objects", "mixtures_drawn": "drawn at random",
            "mixtures_foreign": "one object, and foreign ones",
        },
        {"dataset.of": "objects", "dataset.keep": "of each"}, foreign_reported, errors=False,
    ),
    "subsets": RobustPage(
        "Half of the scans",
        "A random half of each set's scans; those that remain may form several components "
        "without overlap.",
        {"subsets": ""}, {"dataset.of": "data set"}, none_false,
    ),
    "spoilt": RobustPage(
        "Noise, outliers, missing points, sparse scans",
        "Noise is Gaussian along the line of sight, in units of the raw scans' mean "
        "nearest-neighbour distance (3 of these are about one resolution of the registration "
        "points). Outliers are uniform in a scan's bounding box, as a fraction of its points. A "
        "sparse scan keeps a tenth of its points. All together: noise of 1, 20 % outliers, half of "
        "the points, one sparse scan.",
        {
            "spoilt_noise": "noise", "spoilt_outliers": "outliers",
            "spoilt_density": "fewer points", "spoilt_all": "all together",
        },
        {
            "dataset.of": "data set", "dataset.noise": "noise", "dataset.outliers": "outliers",
            "dataset.drop": "lost", "dataset.sparse": "sparse scans",
        },
        none_false,
    ),
    "shapes": RobustPage(
        "Objects whose registration is ambiguous",
        "Scans of a sphere, a plate, a box, a cylinder and a surface of revolution (a bottle), in "
        "random order and random poses: many poses fit equally well, and none may be reported. "
        "`ambiguous`: the number of scans rejected for this reason.",
        {"shapes": ""}, {"dataset.shape": "shape"}, none_placed, errors=False,
    ),
}  # fmt: skip
