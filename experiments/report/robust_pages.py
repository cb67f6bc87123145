"""What the pages on robustness consist of: runs of one or several experiments, judged by scan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from experiments.report.checks import Case, Claim
from experiments.report.goals import GOALS, ORDERS
from experiments.report.outcomes import Row
from experiments.report.tables import markdown, number


@dataclass(frozen=True)
class RobustPage:
    """A page on robustness.

    `experiments` are those that it is about, with a caption each; `labels` the overrides that tell
    its rows apart, with their headings; runs that differ in nothing else share a row. `errors`
    says whether errors of the poses mean something, `timed` whether times are shown; `bars` adds
    a section, `check` the claims.
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
    """There is no false positive, and so one foreign scan has no place.

    Alone of its object, it can only be false or without a place.
    """
    alone = [row for row in rows if row.values[1] == ONE_FOREIGN]
    found = none_of(alone, ["false"])
    return [*none_false(rows), Claim("one foreign scan is never placed", found)]


#: The override of `dataset.keep` with which there is one foreign scan.
ONE_FOREIGN = "[all,1]"


def none_of(rows: Sequence[Row], kinds: Sequence[str]) -> dict[str, Case]:
    """The cases of a claim that there are no scans of some kinds: one for each experiment."""
    cases: dict[str, Case] = {}
    for name in dict.fromkeys(row.experiment for row in rows):
        own = [row for row in rows if row.experiment == name]
        known, total = sum(len(row.known) for row in own), sum(len(row.outcomes) for row in own)
        count = sum(row.count(kind) for row in own for kind in kinds)
        cases[name] = (count == 0, f"{count} in {known} of {total} runs") if known else None
    return cases


def bars(rows: Sequence[Row]) -> list[str]:
    """What was to be reached in all the orders, and what was."""
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
        "The default method on scans in random order, each moved at random.",
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
        "truth of these is good to a few centimetres, so that errors are not shown.",
        {"environments": ""}, SETS, none_false, errors=False, timed=True,
    ),
    "mixtures": RobustPage(
        "Scans of several objects thrown together",
        "All scans of two objects; fifty mixtures drawn at random, of two or three objects and of "
        "each from a fifth of its scans to all; one or three foreign scans among all those of an "
        "object.",
        {
            "mixtures_pairs": "two objects", "mixtures_drawn": "drawn at random",
            "mixtures_foreign": "one object, and foreign ones",
        },
        {"dataset.of": "objects", "dataset.keep": "of each"}, foreign_reported, errors=False,
    ),
    "subsets": RobustPage(
        "Half of the scans",
        "Half of a set's scans are drawn at random, and what is left may fall into parts that "
        "nothing joins.",
        {"subsets": ""}, {"dataset.of": "data set"}, none_false,
    ),
    "spoilt": RobustPage(
        "Noise, outliers, lost points, scans with few points",
        "Noise is along the line of sight, in resolutions: the mean distance of a scan's point to "
        "the nearest other one, as the scans come (3 of them are about one of the points that are "
        "refined on). Outliers are a share of a scan's points, anywhere in its box. A "
        "sparse scan has a tenth of its points. All together: noise of a resolution, 20 % "
        "outliers, half of the points, one sparse scan.",
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
        "Objects that cannot be placed",
        "Scans of a sphere, a plate, a box, a cylinder and a bottle turned on a lathe, in random "
        "order, each moved at random: many poses fit equally well, and none may be given as the "
        "answer. `ambiguous`: scans of which the reason says so.",
        {"shapes": ""}, {"dataset.shape": "shape"}, none_placed, errors=False,
    ),
}  # fmt: skip
