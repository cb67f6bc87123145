"""The page of the noise limit: its table and its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from experiments.common.style import GREY, METHODS, canvas
from mvreg.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = """# The noise limit

`python -m experiments.accuracy.bound`, mvreg {version}, {date}.

Twelve scans of 30,000 points of synthetic shapes, with exact poses, Gaussian range noise and no
quantisation. `adjust=joint` starts from the true poses perturbed by 1 degree and 1 resolution, and
from the result of the default method. Errors are the RMS displacement of the scans' points against
ground truth in the frame of the first scan (mm), RMS over as many draws of noise and viewpoints as
the last column says (for the method: the first draw). The bound is the Cramer-Rao bound of an
unbiased estimator that knows the noise of every ray but not the surface, from the inverse of the
Fisher information matrix. "Reported" is computed from `Result.covariances`, without ground truth;
"squared" is the mean of the normalised squared errors of the poses, 6 where covariances hold, and
"inside" the share of poses within their 95 per cent ellipsoids.

As the noise decreases, the error approaches a floor set by the sampling of the surface: a patch of
45 to 64 points is a paraboloid and cannot model finer relief. That floor is the error without
noise; the point spacing is about 0.5 mm. Patches that the points do not follow count less, which
takes most of that floor away. Where noise dominates, the gap between error and bound has two
causes: patches at the rims of scans serve only where the surface is smooth, although the rays that
graze the surface there hold it best, and relief.

Rooms are seen by the virtual laser scanner from six stations, an office from 16, with no mixed
pixels; their noise is a multiple of the scanner's own, 1 mm and 0.1 mm per metre. Peers start from
the same spoilt poses: Open3D's point-to-plane ICP and small_gicp's generalized ICP of all pairs
that touch, on all points, and Open3D's pose graph over them (in so many draws as were asked for).

In rooms Open3D ends 186 times the bound away from the truth, and does from the true poses as well:
it has come to rest. Most of that is its distance threshold, 2 resolutions of 12 cm there, within
which point-to-plane ICP takes any nearest point, whatever its normal. In the room's first draw a
threshold of 1 resolution leaves 36 times the bound, 0.5 leaves 19, 0.25 leaves 9.2, and 0.1 leaves
8.6. Below 0.5 no pair has the share of fitting points that Open3D's reconstruction system asks for
(0.3), and the pose graph has no edge: these figures are with 0.02. Normals of 100 neighbours
instead of 20 are no better (195), nor is pruning to blame (186 without it); information matrices
that only count points leave 31 instead of 23 at a threshold of 0.5. A Tukey loss of 3 cm leaves
329 at the threshold of 2, and 87 at 0.5: the spoilt poses are 130 mm off.

"""
COLUMNS = (
    "shape", "noise", "bound", "error", "error / bound", "from the method", "reported", "squared",
    "inside", "Open3D / bound", "small_gicp / bound", "draws",
)  # fmt: skip
HEAD += f"| {' | '.join(COLUMNS)} |\n|{len(COLUMNS) * '---|'}\n"


@dataclass(frozen=True)
class Measured:
    """One shape at one noise (mm): RMS over the runs, mm.

    `method` is the error from the default method's result, None where that does not place all
    scans; `squared` the mean normalised squared error of the poses, `inside` the share of poses in
    their 95 per cent ellipsoids; `peers` the errors of Open3D and small_gicp, if asked; `draws` how
    many there were.
    """

    shape: str
    noise: float
    bound: float
    error: float
    reported: float
    squared: float
    inside: float
    method: float | None
    peers: tuple[float, ...] = ()
    draws: int = 1


def row(found: Measured) -> str:
    """One line of the table."""
    ratio = f"{found.error / found.bound:.2f}" if found.bound else ""
    method = "not all placed" if found.method is None else f"{found.method:.4f}"
    peers = [f"{each / found.bound:.1f}" if found.bound else "" for each in found.peers]
    peers += [""] * (2 - len(peers))
    return (
        f"| {found.shape} | {found.noise:g} | {found.bound:.4f} | {found.error:.4f} | {ratio} | "
        f"{method} | {found.reported:.4f} | {found.squared:.1f} | {found.inside:.2f} | "
        f"{peers[0]} | {peers[1]} | {found.draws} |"
    )


def pooled(found: Sequence[Measured]) -> dict[str, dict[float, Array]]:
    """Bound, error, reported and method's error (4,) by family of shapes and noise, RMS.

    The family of ``blob-3`` is ``blob``; where the method has no answer for one shape, NaN.
    """
    gathered: dict[str, dict[float, list[list[float]]]] = {}
    for item in found:
        method = np.nan if item.method is None else item.method
        rows = gathered.setdefault(item.shape.partition("-")[0], {}).setdefault(item.noise, [])
        rows.append([item.bound, item.error, item.reported, method])
    return {
        family: {noise: np.sqrt((np.array(rows) ** 2).mean(axis=0)) for noise, rows in by.items()}
        for family, by in gathered.items()
    }


def draw(families: Mapping[str, Mapping[float, Array]]) -> Figure:
    """Error against noise, a panel for each family, with the bound as a line."""
    figure = canvas(2.9)
    axes = np.atleast_1d(figure.subplots(1, len(families), sharey=True))
    for axis, (family, by) in zip(axes, families.items(), strict=True):
        noises = sorted(by)
        positive = [noise for noise in noises if noise > 0]
        zero = positive[0] / 3  # where a logarithmic axis shows no noise
        places = [noise or zero for noise in noises]
        values = np.array([by[noise] for noise in noises])
        above = [noise > 0 for noise in noises]
        axis.plot(positive, values[above, 0], color="black", label="Cramer-Rao bound")
        axis.plot(places, values[:, 2], "--", color=GREY, label="reported by the covariances")
        axis.plot(places, values[:, 1], "o", color=METHODS["fcpma"], label="from spoilt truth")
        axis.plot(places, values[:, 3], "x", color=METHODS["surfc"], label="from the method")
        axis.set(xscale="log", yscale="log", title=family, xlabel="noise of the range (mm)")
        axis.set_xticks(places, [f"{noise:g}" for noise in noises])
        axis.minorticks_off()
    axes[0].set_ylabel("RMS displacement (mm)")
    axes[0].legend(loc="upper left")
    figure.tight_layout()
    return figure
