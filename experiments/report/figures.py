"""Draw every figure of the report from the experiments' runs.

    python -m experiments.report.figures

Each file's name begins with that of its experiment. What was not run leaves an empty place in its
figure, with the reason; where nothing of a figure was run, there is no figure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.calibration import roc
from experiments.common.runs import ROOT, Run, planned
from experiments.common.scenes import Scene, load_scene
from experiments.common.style import save, styled
from experiments.report.bars import draw_bars
from experiments.report.comparison import Row, draw_comparison
from experiments.report.curves import Axis, Series, draw_curves
from experiments.report.measured import Measured, by_dataset, measured
from experiments.report.orders import draw_orders
from experiments.report.outcomes import rows
from experiments.report.robust_pages import SETS
from experiments.report.showcase import draw_showcase
from mvreg.errors import InputError

RESULTS = Path(__file__).resolve().parents[1] / "results"
#: Scans of the paper's data sets.
SCANS = {"armadillo": 12, "bunny": 10, "buddha": 15, "dragon": 15}
#: The set of the README's picture of real scans.
SHOWN = "bunny"


@dataclass(frozen=True)
class Ablation:
    """A parameter, by its override, and the overrides whose values tell the curves apart.

    Each of these comes with the text that its value stands in.
    """

    key: str
    axis: Axis
    labels: Mapping[str, str]


#: The judges of the ablation, in words.
JUDGES = {"tmse": "Eq. (7)", "tmse_surface": "Eq. (7) and surfaces"}
BY_SET = {"dataset": "{}"}
ABLATIONS = {
    "delta": Ablation(
        "seed.top_fraction",
        Axis("share of the matches that are spread, delta", 0.3, timed=True), BY_SET,
    ),
    "scales": Ablation("describe.scales", Axis("scales of the descriptor, L", 4), BY_SET),
    "tmse": Ablation(
        "judge.resolution_factor", Axis("factor of $d_Q$ in Eq. (7)", 2),
        {"dataset": "{}", "judge": "{}"},
    ),
    "overlap": Ablation("dataset.views", Axis("views all around", 12), BY_SET),
    "noise": Ablation("dataset.noise", Axis("noise of the range (mm)", 0.08), BY_SET),
    "sampling": Ablation(
        "downsample.stride", Axis("scan points per point refined on", 10, True, timed=True),
        {"downsample.keypoint_ratio": "{} scan points per keypoint"},
    ),
}  # fmt: skip


def draw_all(root: Path = ROOT, out: Path = RESULTS) -> list[Path]:
    """Draw what there are runs of.

    Parameters
    ----------
    root : Path
        The experiments' folders.
    out : Path
        Where to write the PNG files.

    Returns
    -------
    list of Path
        The files written.
    """
    drawings: list[Callable[[], Path | None]] = [
        lambda: bars("table1", root, out / "table1_fig7.png"),
        lambda: bars("table2", root, out / "table2_fig8.png"),
        lambda: cross_sections("table2", root, out / "table2_fig9.png"),
        lambda: showcase("table2", root, out / f"{SHOWN}.png"),
        *(lambda name=name: ablation(name, root, out / f"{name}.png") for name in ABLATIONS),
        lambda: orders("orders", root, out / "orders.png"),
        lambda: roc.draw(root / "roc", out / "tmse_roc.png"),
    ]
    with styled():
        return [file for file in (draw() for draw in drawings) if file is not None]


def bars(experiment: str, root: Path, file: Path) -> Path | None:
    """Fig. 7 or 8."""
    table = by_dataset(planned(experiment, root))
    groups = {name: {m: measured(run) for m, run in row.items()} for name, row in table.items()}
    if all(each.word for row in groups.values() for each in row.values()):
        return None
    return save(draw_bars(groups, SCANS), file, 64)


def cross_sections(experiment: str, root: Path, file: Path) -> Path | None:
    """Fig. 9."""
    table = by_dataset(planned(experiment, root))
    rows = [
        Row(name, scene(row), {m: measured(run) for m, run in row.items()})
        for name, row in table.items()
    ]
    if all(row.scene is None for row in rows):
        return None
    methods = list(next(iter(table.values())))
    return save(draw_comparison(rows, methods, "fcpma"), file, 160)


def showcase(experiment: str, root: Path, file: Path) -> Path | None:
    """The picture of real scans for the README."""
    row = by_dataset(planned(experiment, root)).get(SHOWN, {})
    found = scene({name: run for name, run in row.items() if name == "fcpma"})
    return save(draw_showcase(found, "fcpma"), file, 160) if found is not None else None


def orders(experiment: str, root: Path, file: Path) -> Path | None:
    """Errors and pairs in random orders."""
    found = rows({experiment: planned(experiment, root)}, SETS)
    if not any(row.known for row in found):
        return None
    return save(draw_orders(found), file, 64)


def scene(row: Mapping[str, Run]) -> Scene | None:
    """The scans and results of one data set; None without results, or where the scans are not."""
    reports = {method: run.report for method, run in row.items() if run.report is not None}
    try:
        return load_scene(reports) if reports else None
    except InputError:
        return None


def ablation(name: str, root: Path, file: Path) -> Path | None:
    """The curves of one ablation."""
    what = ABLATIONS[name]
    series = curves(planned(name, root), what)
    if all(m.word for jobs in series.values() for _, m in jobs):
        return None
    return save(draw_curves(series, what.axis), file, 64)


def curves(jobs: Sequence[Run], what: Ablation) -> Series:
    """The jobs by curve, each with its value of the parameter."""
    series: dict[str, list[tuple[float, Measured]]] = {}
    for run in jobs:
        values = {key: run.value(key) for key in what.labels}
        label = ", ".join(
            text.format(JUDGES.get(values[key], values[key])) for key, text in what.labels.items()
        )
        series.setdefault(label, []).append((float(run.value(what.key)), measured(run)))
    return series


if __name__ == "__main__":
    for written in draw_all():
        print(written)
