"""Read glTF and GLB files through trimesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.cloud import PointCloud
from mvreg.types.attributes import COLOURS, Values


def read_gltf(path: Path) -> PointCloud:
    """Read the points and triangles of a file, all its nodes together, in the file's world.

    The format's unit is the metre and its +y is up; the points stay as they are.

    Raises
    ------
    InputError
        With file and reason; where trimesh is not installed, how to install it.
    """
    data = path.read_bytes()
    if path.suffix.lower() == ".glb":
        stated = int.from_bytes(data[8:12], "little")
        if data[:4] != b"glTF" or stated != len(data):
            raise InputError(
                f"{path}, byte 0: expected 'glTF' and {stated} bytes as the header says, got "
                f"{data[:4]!r} and {len(data)}; the file is truncated or of another format"
            )
    try:
        import trimesh
    except ImportError as error:
        raise InputError(
            f"{path}: glTF files are read through trimesh, which is not installed; "
            "pip install 'mvreg[mesh]'"
        ) from error
    try:
        scene = trimesh.load_scene(path, process=False, skip_materials=True)
        parts = [_part(scene, node) for node in scene.graph.nodes_geometry]
    except (OSError, MemoryError):
        raise
    except Exception as error:  # trimesh, NumPy and json raise as they please
        raise InputError(
            f"{path}: not a readable glTF file: {type(error).__name__}: {error}"
        ) from error
    parts = [part for part in parts if len(part[0])]
    if not parts:
        raise InputError(f"{path}: expected points or meshes, found none; leave this file out")
    starts = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    faces = [
        triangles + start
        for (_, triangles, _), start in zip(parts, starts[:-1], strict=True)
        if triangles is not None
    ]
    colours = [colour for _, _, colour in parts if colour is not None]
    together = np.concatenate(colours) if len(colours) == len(parts) else None
    return PointCloud(
        np.concatenate([points for points, _, _ in parts]),
        attributes={}
        if together is None
        else {name: together[:, i].copy() for i, name in enumerate(COLOURS)},
        triangles=np.concatenate(faces) if faces else None,
    )


def _part(scene: object, node: str) -> tuple[Values, Values | None, Values | None]:
    """Points (N, 3) in the world, triangles and colours of a node."""
    transform, name = scene.graph[node]  # type: ignore[attr-defined]
    shape = scene.geometry[name]  # type: ignore[attr-defined]
    points = np.asarray(shape.vertices, dtype=np.float64).reshape(-1, 3)
    faces = getattr(shape, "faces", None)
    colours = getattr(shape, "colors", None)
    if colours is None and getattr(getattr(shape, "visual", None), "kind", None) == "vertex":
        colours = shape.visual.vertex_colors
    known = colours is not None and np.shape(colours) == (len(points), 4)
    return (
        se3.apply(np.asarray(transform, dtype=np.float64), points),
        None if faces is None else np.asarray(faces, dtype=np.int64).reshape(-1, 3),
        np.asarray(colours)[:, :3].astype(np.uint8) if known else None,
    )
