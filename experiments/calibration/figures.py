"""ROC curves and the reliability diagram of the judge by evidence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from experiments.calibration.fit import reliability
from experiments.calibration.roc import area, curve
from experiments.common.style import GREY, absent, canvas
from mvreg.stages.judge.evidence import EvidenceJudge

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from experiments.calibration.calibrate import Judged

#: What is known of the sensors: legend, colour, line and marker.
SETTINGS = {
    "known": ("sensors known", "#0072B2", "-", "o"),
    "estimated": ("sensors estimated", "#D55E00", "--", "s"),
    "none": ("without sensors", "#7F7F7F", ":", "^"),
}
#: Sets that have a panel: the group of right poses, and those of foreign scans that join it.
PANELS = {
    "bunny": ("bunny", "bunny~noise", "bunny+dragon", "figurine+bunny"),
    "dragon": ("dragon", "bunny+dragon", "dragon+buddha"),
    "buddha": ("buddha", "dragon+buddha"),
    "figurine": ("figurine", "figurine~noise", "figurine+bunny"),
    "room": ("room-0", "room-1", "room-2", "room-1+room-2", "office-0+room-0"),
    "office": ("office-0", "office-1", "tls_office", "office-0+room-0"),
    "street": ("street-0", "street-1", "lidar_campus", "street-0+street-1"),
    "desk": ("desk-0", "desk-1", "rgbd_desk"),
}
#: Edges of the bins of probability.
EDGES = np.array([0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98, 1.0])


def pool(
    groups: Mapping[str, Judged], names: tuple[str, ...], *, best: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Probabilities and truth of several groups together, all poses or the best of attempts."""
    chances, right = [np.empty(0)], [np.empty(0, dtype=bool)]
    for one in (groups[name] for name in names if name in groups):
        chosen = one.best if best and one.best is not None else np.ones(len(one.right), dtype=bool)
        chances.append(one.chances[chosen])
        right.append(one.right[chosen])
    return np.concatenate(chances), np.concatenate(right)


def draw_roc(judged: Mapping[str, Mapping[str, Judged]]) -> Figure:
    """A panel per kind, with the scans of other objects: the corner that matters."""
    figure = canvas(5.2)
    threshold = EvidenceJudge().min_probability
    axes = figure.subplots(2, len(PANELS) // 2, sharex=True, sharey=True).flat
    for axis, (name, names) in zip(axes, PANELS.items(), strict=True):
        for setting, (label, colour, style, marker) in SETTINGS.items():
            chances, right = pool(judged.get(setting, {}), names)
            if not right.any() or right.all():
                continue
            legend = f"{label}: {area(-chances, right):.4f}"
            axis.plot(*curve(-chances, right), style, color=colour, label=legend)
            taken = chances >= threshold
            axis.plot(taken[~right].mean(), taken[right].mean(), marker, color=colour, zorder=4)
            axis.set_title(f"{name}: {right.sum()} right, {(~right).sum()} wrong", fontsize=8.5)
        if not axis.lines:
            absent(axis, "not run", name)
            continue
        axis.set(xlim=(-0.001, 0.05), ylim=(0.3, 1.01))
        axis.legend(loc="lower right", fontsize=7, title="AUC", title_fontsize=7)
    figure.supxlabel(f"wrong poses accepted (share); marks: at {threshold:g}", fontsize=8.5)
    figure.supylabel("right poses accepted (share)", fontsize=8.5, x=0.01)
    figure.subplots_adjust(left=0.07, right=0.985, bottom=0.11, top=0.94, wspace=0.12, hspace=0.2)
    return figure


def draw_reliability(judged: Mapping[str, Mapping[str, Judged]]) -> Figure:
    """The share of right poses against their probability, of the best poses of all attempts."""
    figure = canvas(3.2, 6.0)
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
    for setting, (label, colour, style, marker) in SETTINGS.items():
        chances, right = pool(judged.get(setting, {}), tuple(judged.get(setting, {})), best=True)
        if not len(right):
            continue
        mean, share, count = zip(*reliability(chances, right, EDGES), strict=True)
        axis.plot(mean, share, style, color=colour, marker=marker, label=label)
        if setting == "known":
            for x, y, number in zip(mean, share, count, strict=True):
                axis.annotate(
                    str(number),
                    (x, y),
                    (5, -4) if x > 0.1 else (6, 3),
                    textcoords="offset points",
                    fontsize=7,
                )
    axis.set(xlabel="probability, by weights fitted to other kinds", ylabel="share that is right",
             xlim=(-0.02, 1.07), ylim=(-0.03, 1.03))  # fmt: skip
    axis.legend(loc="upper left")
    figure.subplots_adjust(left=0.11, right=0.98, bottom=0.15, top=0.97)
    return figure
