"""The README's picture: the figurine's scans as they come, and placed."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mvreg
from mvreg import se3
from mvreg.datasets.viewpoints import orbit
from mvreg.nearest import WORKERS, build_tree
from mvreg.normals import Orient, estimate_normals
from mvreg.types import Array, Indices

FILE = Path(__file__).parent / "results" / "figurine.png"
CLAY = np.array([0.80, 0.76, 0.70])
#: So many pixels, each way, are painted for one of the picture.
FINER = 3
#: Radius of a point (mm), somewhat more than the spacing of the scans.
DOT = 0.7
#: Of the picture; and the pixels above the panels.
DPI, TITLE = 200, 60
#: Towards the light, in the frame of the picture: x to the right, y up, z to the eye.
LIGHT = np.array([-0.45, 0.55, 0.70])


@dataclass(frozen=True, eq=False)
class Cloud:
    """Coloured points (N, 3) with unit normals (N, 3) and colours (N, 3) between 0 and 1."""

    points: Array
    normals: Array
    colours: Array

    def seen_from(self, T_world_eye: Array) -> Cloud:
        """The cloud in the frame of an eye that looks along -z."""
        T_eye_world = se3.invert(T_world_eye)
        normals = self.normals @ T_eye_world[:3, :3].T
        return Cloud(se3.apply(T_eye_world, self.points), normals, self.colours)

    def painted(self, colour: Array) -> Cloud:
        """The same in one colour."""
        return Cloud(self.points, self.normals, np.broadcast_to(colour, self.points.shape))


def together(clouds: list[Cloud]) -> Cloud:
    """All the points of several clouds."""
    parts = zip(*((c.points, c.normals, c.colours) for c in clouds), strict=True)
    return Cloud(*(np.concatenate(part) for part in parts))


def render(cloud: Cloud, width: float, height: float, scale: float) -> Array:
    """Paint a cloud, in the frame of the eye and around its origin; far points first.

    Parameters
    ----------
    cloud : Cloud
    width, height : float
        Of the picture (mm).
    scale : float
        Pixels per mm.

    Returns
    -------
    (rows, columns, 3) array
        Between 0 and 1, on white.
    """
    step = scale * FINER
    shape = np.array([round(height * scale), round(width * scale)]) * FINER
    facing = cloud.normals[:, 2] > 0
    points, normals = cloud.points[facing], cloud.normals[facing]
    colours = shaded(normals, cloud.colours[facing])
    order = np.argsort(points[:, 2], kind="stable")
    rows = np.rint(shape[0] / 2 - points[order, 1] * step).astype(int)
    columns = np.rint(shape[1] / 2 + points[order, 0] * step).astype(int)
    image = np.ones((*shape, 3))
    depth = np.full(shape, -np.inf)
    for down, right in disc(DOT * step):
        row, column = rows + down, columns + right
        inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
        paint(image, depth, row[inside], column[inside], points[order][inside, 2],
              colours[order][inside])  # fmt: skip
    return coarsened(image)


def paint(
    image: Array, depth: Array, row: Indices, column: Indices, z: Array, colours: Array
) -> None:
    """Paint one pixel per point where it is in front of what is there; `z` (N,) ascends."""
    nearer = z > depth[row, column]
    row, column = row[nearer], column[nearer]
    depth[row, column] = z[nearer]  # of several points in one pixel the last, the nearest, stays
    image[row, column] = colours[nearer]


def shaded(normals: Array, colours: Array) -> Array:
    """Colours (N, 3) of a dull surface under one light."""
    light = LIGHT / np.linalg.norm(LIGHT)
    bright = 0.32 + 0.74 * np.clip(normals @ light, 0, 1) + 0.12 * normals[:, 2]
    lit: Array = np.clip(colours * bright[:, None], 0, 1)
    return lit


def disc(radius: float) -> list[tuple[int, int]]:
    """The pixels of a disc around the origin."""
    reach = range(-int(radius), int(radius) + 1)
    return [(i, j) for i in reach for j in reach if i * i + j * j <= radius * radius]


def coarsened(image: Array) -> Array:
    """Means over squares of pixels: smooth edges."""
    rows, columns = image.shape[0] // FINER, image.shape[1] // FINER
    smooth: Array = image.reshape(rows, FINER, columns, FINER, 3).mean(axis=(1, 3))
    return smooth


def scans_and_result() -> tuple[list[Cloud], list[Cloud]]:
    """The scans as given, each in its own frame, and placed, in the frame of the figure."""
    from matplotlib import colormaps

    scans = mvreg.dataset("figurine", rng=1, order="shuffle")
    result = mvreg.register(scans, method="fcpma")
    if result.unregistered or scans.poses is None:
        raise SystemExit(f"not placed: {', '.join(result.unregistered)}")
    upright = scans.poses[result.reference]  # the truth, but only to stand the figure on its feet
    given, placed = [], []
    for index, scan in enumerate(scans.scans):
        colour = np.array(colormaps["Set3"](index)[:3])
        normals = estimate_normals(scan, scan.points, Orient.auto, 30)
        cloud = Cloud(scan.points, normals, np.broadcast_to(colour, scan.points.shape))
        given.append(cloud)
        placed.append(cloud.seen_from(se3.invert(upright @ result.poses[scan.name])))
    return given, placed


def laid_out(clouds: list[Cloud], columns: int, width: float, height: float) -> Cloud:
    """Clouds side by side in rows, each as its sensor saw it."""
    rows = -(-len(clouds) // columns)
    spread = []
    for index, cloud in enumerate(clouds):
        row, column = divmod(index, columns)
        middle = (cloud.points.min(axis=0) + cloud.points.max(axis=0)) / 2
        across, up = column - (columns - 1) / 2, (rows - 1) / 2 - row
        shift = np.array([across * width, up * height, 0])
        spread.append(Cloud(cloud.points - middle + shift, cloud.normals, cloud.colours))
    return together(spread)


def smoothed(cloud: Cloud, neighbours: int = 24) -> Cloud:
    """The cloud with normals averaged over neighbours that face the same way."""
    tree = build_tree(cloud.points)
    _, indices = tree.query(cloud.points, k=neighbours, workers=WORKERS)
    nearby = cloud.normals[indices]
    same = np.einsum("nkc,nc->nk", nearby, cloud.normals) > 0
    total = (nearby * same[..., None]).sum(axis=1)
    normals = total / np.linalg.norm(total, axis=1, keepdims=True)
    return Cloud(cloud.points, normals, cloud.colours)


def panels() -> list[tuple[str, Array]]:
    """Titles and pictures, from left to right."""
    given, placed = scans_and_result()
    model = together(placed)
    middle = (model.points.min(axis=0) + model.points.max(axis=0)) / 2
    back = model.seen_from(orbit(middle, 1.0, 205, 8))
    front = smoothed(model).seen_from(orbit(middle, 1.0, 25, 8)).painted(CLAY)
    scans = laid_out(given, 4, 118, 165)
    return [
        (f"{len(given)} scans, unordered", render(scans, 4 * 118, 3 * 165, 1.4)),
        ("registered, coloured by scan", render(back, 122, 165, 4.2)),
        ("the same points in one colour", render(front, 122, 165, 4.2)),
    ]


def main(file: Path) -> None:
    """Draw the panels side by side, one pixel for each of theirs, and save few colours."""
    from matplotlib.figure import Figure
    from PIL import Image

    drawn = panels()
    heights, widths, _ = zip(*(image.shape for _, image in drawn), strict=True)
    size = (sum(widths) / DPI, (max(heights) + TITLE) / DPI)
    figure = Figure(size, DPI)
    axes = figure.subplots(1, len(drawn), width_ratios=widths)
    figure.subplots_adjust(0, 0, 1, 1 - TITLE / DPI / size[1], 0)
    for axis, (title, image) in zip(axes, drawn, strict=True):
        axis.imshow(image)
        axis.set_title(title, fontsize=9)
        axis.axis("off")
    figure.savefig(file)
    few = Image.open(file).convert("RGB").quantize(192, dither=Image.Dither.NONE)
    few.save(file, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
