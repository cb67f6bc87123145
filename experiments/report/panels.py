"""The panels that show scans: painted as surfaces, and cut."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.common.render import CLAY, Cloud, laid_out, render, smoothed, together
from experiments.common.scenes import Scene
from experiments.common.style import DPI
from experiments.report.cross_sections import MEET, Cut, Window, choose_slab, choose_window
from mvreg.types import Array

#: Half the side of the window that is enlarged, of the larger side of the cross-section.
PART = 0.045
#: The thickness of a slab, in resolutions of the registration points.
THICK = 1.0
#: Around a cross-section, of its larger side.
MARGIN = 0.03
#: Diameter of a point: in the whole, and where it is enlarged (points of type).
FINE, COARSE = 1.0, 2.2


@dataclass(frozen=True, eq=False)
class Slices:
    """The same slab through the results of several methods, and the part of it to enlarge."""

    cuts: Mapping[str, Cut]
    window: Window

    @property
    def limits(self) -> tuple[Array, Array]:
        """Corners (2,) of what all the cross-sections fill, with a margin."""
        points = points_of(self.cuts.values())
        low, high = points.min(axis=0), points.max(axis=0)
        margin = MARGIN * (high - low).max()
        return low - margin, high + margin

    @property
    def aspect(self) -> float:
        """Height over width."""
        low, high = self.limits
        width, height = high - low
        return float(height / width)


def slices(scene: Scene, methods: Sequence[str]) -> Slices:
    """Cut the results that the scene has of these methods, where the last one overlaps most."""
    placed = {m: scene.placed(m) for m in methods if m in scene.poses}
    thickness = THICK * scene.resolution
    slab = choose_slab(list(list(placed.values())[-1].values()), thickness)
    cuts: dict[str, Cut] = {
        method: {name: slab.cut(cloud) for name, cloud in clouds.items()}
        for method, clouds in placed.items()
    }
    half = PART * float(np.ptp(points_of(cuts.values()), axis=0).max())
    return Slices(cuts, choose_window(list(cuts.values()), half, MEET * thickness))


def points_of(cuts: Iterable[Cut]) -> Array:
    """All the points (N, 2) of several cross-sections."""
    return np.concatenate([section.points for cut in cuts for section in cut.values()])


def whole(axis: Any, shown: Slices, method: str, scene: Scene) -> None:
    """A cross-section, with a frame around what is enlarged beside it."""
    from matplotlib.patches import Rectangle

    scatter(axis, shown.cuts[method], scene, FINE)
    low, high = shown.limits
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axis.spines[:].set_visible(False)
    corner, side = shown.window.centre - shown.window.half, 2 * shown.window.half
    axis.add_patch(Rectangle(tuple(corner), side, side, fill=False, edgecolor="black", lw=0.9))


def part(axis: Any, shown: Slices, method: str, scene: Scene) -> None:
    """What the frame of the cross-section holds, and a bar of known length."""
    centre, half = shown.window.centre, shown.window.half
    scatter(axis, shown.cuts[method], scene, COARSE)
    axis.set(xlim=centre[0] + np.array([-half, half]), ylim=centre[1] + np.array([-half, half]))
    axis.spines[:].set(visible=True, color="black", linewidth=0.9)
    length = round_length(0.8 * half)
    right, up = emptiest_corner(points_of(shown.cuts.values()), shown.window)
    start = centre[0] + (0.9 * half - length if right else -0.9 * half)
    height = centre[1] + (0.68 * half if up else -0.9 * half)
    axis.plot([start, start + length], [height, height], color="black", lw=1.8,
              solid_capstyle="butt")  # fmt: skip
    axis.text(start + length / 2, height + 0.05 * half, f"{length:g} {scene.unit}", fontsize=8,
              ha="center", va="bottom")  # fmt: skip


def scatter(axis: Any, cut: Cut, scene: Scene, diameter: float) -> None:
    """All the points of a cross-section, none of the scans always on top."""
    points = points_of([cut])
    colours = [np.broadcast_to(scene.clouds[n].colours[0], (len(s), 3)) for n, s in cut.items()]
    order = np.random.default_rng(0).permutation(len(points))
    axis.scatter(*points[order].T, s=diameter**2, c=np.concatenate(colours)[order], linewidths=0)
    axis.set_aspect("equal")
    axis.set(xticks=[], yticks=[])


def emptiest_corner(points: Array, window: Window) -> tuple[bool, bool]:
    """Whether to the right, and whether up: the quarter of the window with the fewest points."""
    inside = points[window.holds(points)] > window.centre
    corners = [(right, up) for up in (False, True) for right in (False, True)]
    return min(corners, key=lambda corner: int((inside == corner).all(axis=1).sum()))


def round_length(about: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `about`."""
    power = 10.0 ** np.floor(np.log10(about))
    return float(max(factor * power for factor in (1, 2, 5) if factor * power <= about))


def scans_as_given(scene: Scene, width: float, height: float) -> Array:
    """The scans side by side, each as its sensor saw it, as large as so many inches allow."""
    clouds = [without_strays(cloud) for cloud in scene.clouds.values()]
    size = np.array([np.ptp(cloud.points, axis=0)[:2] for cloud in clouds]).max(axis=0) * 1.06
    fits = {n: min(width / (n * size[0]), height / (-(-len(clouds) // n) * size[1]))
            for n in range(1, len(clouds) + 1)}  # fmt: skip
    columns = max(fits, key=lambda n: fits[n])
    extent = np.array([columns, -(-len(clouds) // columns)]) * size
    return fitted(laid_out(clouds, columns, size[0], size[1]), extent, width, height, scene)


def model(scene: Scene, method: str, width: float, height: float, coloured: bool = False) -> Array:
    """All placed scans as one surface, seen from where the first scan was taken."""
    cloud = without_strays(together(list(scene.placed(method).values())))
    cloud = cloud if coloured else smoothed(cloud).painted(CLAY)
    middle = (cloud.points.min(axis=0) + cloud.points.max(axis=0)) / 2
    centred = Cloud(cloud.points - middle, cloud.normals, cloud.colours)
    extent = np.ptp(cloud.points, axis=0)[:2] * 1.04
    return fitted(centred, extent, width, height, scene)


def without_strays(cloud: Cloud) -> Cloud:
    """The cloud without the few points far outside, which would make all else small."""
    low, high = np.quantile(cloud.points, [0.002, 0.998], axis=0)
    margin = 0.03 * (high - low).max()
    kept = ((cloud.points > low - margin) & (cloud.points < high + margin)).all(axis=1)
    return Cloud(cloud.points[kept], cloud.normals[kept], cloud.colours[kept])


def fitted(cloud: Cloud, extent: Array, width: float, height: float, scene: Scene) -> Array:
    """Paint a cloud as large as so many inches allow, without holes between its points."""
    scale = DPI * min(width / extent[0], height / extent[1])
    dot = max(0.5 * scene.resolution, 0.35 / scale)
    return render(cloud, float(extent[0]), float(extent[1]), scale, dot)


def painted(axis: Any, image: Array) -> None:
    """Show a picture in a panel, without a frame."""
    axis.imshow(image)
    axis.set_axis_off()
