"""Points and attributes of the objects of other libraries, told by their package's name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mvreg.geometry.triangles import on_coarse_triangles
from mvreg.types.attributes import COLOURS, Values
from mvreg.types.named_columns import ForeignError, colours, from_columns, normals

__all__ = ["READERS", "ForeignError"]

Found = tuple[Any, dict[str, Values]]


def _open3d(value: Any) -> Found:
    """A cloud's points or a mesh's vertices, of the old classes or of those of tensors."""
    name, tensors = type(value).__name__, ".t." in type(value).__module__
    if name == "Tensor":
        return value.cpu().numpy(), {}
    if name.startswith("Vector"):
        return np.asarray(value), {}
    if name not in ("PointCloud", "TriangleMesh"):
        raise ForeignError(
            f"expected a PointCloud or a TriangleMesh of Open3D, got a {name}; pass its points"
        )
    cloud = name == "PointCloud"
    if tensors:
        found, told = _open3d_tensors(value.point if cloud else value.vertex)
        if cloud or "indices" not in value.triangle:
            return found, told
        return _on_mesh(found, value.triangle["indices"].cpu().numpy(), told)
    if not cloud:
        told = {**colours(value.vertex_colors), **normals(value.vertex_normals)}
        return _on_mesh(value.vertices, value.triangles, told)
    return np.asarray(value.points), {**colours(value.colors), **normals(value.normals)}


def _open3d_tensors(tensors: Any) -> Found:
    """The attributes of points or vertices, of which the positions are one."""
    held = {key: tensors[key].cpu().numpy() for key in tensors}
    if "positions" not in held:
        return np.empty((0, 3)), {}
    columns = {
        key: v.reshape(-1) if v.ndim == 2 and v.shape[1] == 1 else v for key, v in held.items()
    }
    return from_columns(columns)


def _trimesh(value: Any) -> Found:
    """A cloud's points or a mesh's vertices; colours where each has its own."""
    if isinstance(value, np.ndarray):
        return value, {}
    if not hasattr(value, "vertices"):
        raise ForeignError(
            f"expected a PointCloud or a Trimesh, got a {type(value).__name__}; of a Scene pass "
            "scene.to_geometry()"
        )
    own = getattr(getattr(value, "visual", None), "kind", None) == "vertex"
    paint = value.visual.vertex_colors if own else getattr(value, "colors", ())
    return _on_mesh(value.vertices, getattr(value, "faces", ()), colours(paint))


def _on_mesh(vertices: Any, triangles: Any, told: dict[str, Values]) -> Found:
    """The vertices, or of a mesh too coarse for them, points on its triangles.

    As with files, see `on_coarse_triangles`: colours are interpolated, normals the triangles' own.
    """
    points, faces = np.asarray(vertices, dtype=np.float64), np.asarray(triangles)
    shaped = faces.ndim == 2 and faces.shape[1] == 3 and points.ndim == 2
    found = on_coarse_triangles(points, faces) if shaped and len(points) else None
    if found is None:
        return points, told
    smooth = {name: found.interpolated(told[name]) for name in COLOURS if name in told}
    return found.points, {**smooth, **normals(found.normals)}


def _frame(value: Any) -> Found:
    """A data frame's columns; a series and an index are arrays."""
    if not hasattr(value, "columns"):
        return np.asarray(value), {}
    return from_columns({key: value[key].to_numpy() for key in value.columns})


def _torch(value: Any) -> Found:
    """A tensor, wherever it is, and whether or not it has gradients."""
    return value.detach().cpu().double().numpy(), {}


def _cupy(value: Any) -> Found:
    """An array on a GPU."""
    return value.get(), {}


#: How the objects of a package are read, by the package's name.
READERS: dict[str, Callable[[Any], Found]] = {
    "open3d": _open3d,
    "trimesh": _trimesh,
    "pandas": _frame,
    "polars": _frame,
    "torch": _torch,
    "cupy": _cupy,
}
