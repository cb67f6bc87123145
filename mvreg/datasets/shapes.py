"""Shapes in code, as closed triangle meshes in mm: the figurine, and others to test with."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from mvreg.datasets import sdf
from mvreg.datasets.gnome import gnome
from mvreg.datasets.mesh import Mesh, cuboid, lathe
from mvreg.datasets.relief import bumps
from mvreg.datasets.surfacenets import surface_net
from mvreg.errors import InputError
from mvreg.types import Array, Indices


@lru_cache(maxsize=32)
def shape(name: str) -> Mesh:
    """A shape by its name.

    Parameters
    ----------
    name : str
        ``gnome``, the figurine; ``blob-N``, asymmetric and smooth, another for each number N; or,
        too symmetric or too plain for their scans to be registered, ``sphere``, ``plate``, ``box``,
        ``cylinder``, ``bottle``.

    Returns
    -------
    Mesh
        Closed, 120 to 210 mm from corner to corner; shared, so that it must not be changed.

    Raises
    ------
    InputError
        If there is no such shape.
    """
    blob_number = re.fullmatch(r"blob-(\d+)", name)
    if blob_number:
        return _mesh(*surface_net(_blob(int(blob_number[1])), step=1.2))
    if name not in SHAPES:
        options = ", ".join([*SHAPES, "blob-0, blob-1, ..."])
        raise InputError(f"shape={name!r} is not known; options: {options}")
    return _mesh(*SHAPES[name]())


def _mesh(vertices: Array, triangles: Indices) -> Mesh:
    for array in (vertices, triangles):
        array.flags.writeable = False
    return Mesh(vertices, triangles)


def _gnome() -> tuple[Array, Indices]:
    return surface_net(gnome(), step=1.0)


def _blob(number: int) -> list[sdf.Part]:
    """Ellipsoids grown out of each other, melted together, with bumps of three sizes."""
    rng = np.random.default_rng([number, 0xB10B])
    seeds = rng.integers(2**32, size=3)
    fine, middle, coarse = bumps(9, 0.3, seeds[0]), bumps(22, 1.2, seeds[1]), bumps(45, 3, seeds[2])

    def relief(points: sdf.Array) -> sdf.Array:
        return fine(points) + middle(points) + coarse(points)

    centre, centres, parts = np.zeros(3), [], []
    for index in range(7):
        radii = rng.uniform(12, 26, size=3) * (1 if index else 1.4)
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        parts.append(sdf.ellipsoid(centre.tolist(), radii.tolist(), axes, relief, blend=20.0))
        centres.append(centre)
        towards = rng.normal(size=3)
        step = rng.uniform(16, 26) * towards / np.linalg.norm(towards)
        centre = centres[rng.integers(len(centres))] + step
    return parts


def _sphere() -> tuple[Array, Indices]:
    angle = np.linspace(-np.pi / 2, np.pi / 2, 201)
    return lathe(np.column_stack([60 * np.cos(angle), 60 * np.sin(angle)]))


def _cylinder() -> tuple[Array, Indices]:
    return lathe(np.array([(0, -60), (35, -60), (35, 60), (0, 60)], dtype=float))


def _bottle() -> tuple[Array, Indices]:
    height = np.linspace(0, 150, 301)
    knots = [0, 6, 12, 70, 84, 98, 118, 132, 136, 142, 150]
    radii = [33, 35, 34, 36, 33, 20, 12, 11, 14, 14, 12]
    radius = np.interp(height, knots, radii)
    kernel = np.hanning(25) / np.hanning(25).sum()
    radius = np.convolve(np.pad(radius, 12, mode="edge"), kernel, mode="valid")
    profile = np.vstack([(0, 0), np.column_stack([radius, height]), (0, 150)])
    return lathe(profile)


SHAPES: dict[str, Callable[[], tuple[Array, Indices]]] = {
    "gnome": _gnome,
    "sphere": _sphere,
    "plate": lambda: cuboid(120, 4, 120),
    "box": lambda: cuboid(80, 50, 110),
    "cylinder": _cylinder,
    "bottle": _bottle,
}
