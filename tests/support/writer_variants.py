"""Files that other programs write of the same points, each in all its variants: `ALL`."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mvreg._open3d import load_open3d

N = 300
RNG = np.random.default_rng(17)
POINTS = RNG.normal(size=(N, 3)).round(3)
NORMALS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
COLOURS = RNG.integers(0, 256, (N, 3)).astype("u1")
INTENSITY = np.arange(N) / 512
FACES = np.arange(N).reshape(-1, 3)
AXES, RGB, UP = ("x", "y", "z"), ("red", "green", "blue"), ("nx", "ny", "nz")
#: Single precision of coordinates up to 4.
SINGLE = 2.0**-21


@dataclass(frozen=True)
class Variant:
    """One file of one writer: how to write it, and what must be read of it, or of the refusal."""

    writer: str
    what: str
    suffix: str
    write: Callable[[Path], object]
    close: float = 0.0
    has: str = ""  # c colours, n normals, i intensity, m a mesh
    refused: str = ""


ALL: list[Variant] = []


def writes(writer: str, what: str, suffix: str, **more: Any) -> Callable[[Any], Any]:
    """Register a function as a variant."""

    def added(write: Callable[[Path], object]) -> Callable[[Path], object]:
        ALL.append(Variant(writer, what, suffix, write, **more))
        return write

    return added


def need(module: str) -> Any:
    return pytest.importorskip(module, reason=f"NOT TESTED: {module} is not installed")


def cloud() -> Any:
    open3d = load_open3d()
    vector = open3d.utility.Vector3dVector
    made = open3d.geometry.PointCloud(vector(POINTS))
    made.normals, made.colors = vector(NORMALS), vector(COLOURS / 255)
    return made


for suffix, kind, options, has in [
    ("ply", "text", {"write_ascii": True}, "cn"), ("ply", "bytes", {}, "cn"),
    ("pcd", "text", {"write_ascii": True}, "cn"), ("pcd", "bytes", {}, "cn"),
    ("pcd", "compressed", {"compressed": True}, "cn"), ("xyz", "text", {}, ""),
    ("xyzn", "text", {}, "n"), ("xyzrgb", "text", {}, "c"), ("pts", "text", {}, "c"),
]:  # fmt: skip

    @writes("Open3D", f"{suffix} {kind}", suffix, close=1e-5, has=has)
    def legacy(path: Path, options: dict[str, bool] = options) -> None:
        assert load_open3d().io.write_point_cloud(str(path), cloud(), **options)


for suffix, kind, code, options in [
    *((s, k, c, o) for c in ("f4", "f8") for s, k, o in (
        ("ply", "text", {"write_ascii": True}), ("ply", "bytes", {}),
        ("pcd", "text", {"write_ascii": True}), ("pcd", "bytes", {}),
        ("pcd", "compressed", {"compressed": True}),
    )),
    ("npz", "arrays", "f8", {}),
]:  # fmt: skip

    @writes("Open3D's tensors", f"{suffix} {kind} {code}", suffix, close=1e-5, has="c")
    def tensors(path: Path, code: str = code, options: dict[str, bool] = options) -> None:
        open3d = load_open3d()
        made = open3d.t.geometry.PointCloud(POINTS.astype(code))
        made.point.colors = COLOURS
        assert open3d.t.io.write_point_cloud(str(path), made, **options)


for suffix in ("ply", "stl", "obj", "off", "glb", "gltf"):

    @writes("Open3D's meshes", suffix, suffix, close=1e-5, has="m")
    def mesh(path: Path) -> None:
        open3d = load_open3d()
        made = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(POINTS), open3d.utility.Vector3iVector(FACES)
        )
        made.compute_triangle_normals()
        assert open3d.io.write_triangle_mesh(str(path), made)


for suffix, kind, close in [
    ("ply", "binary", SINGLE), ("ply", "ascii", 1e-5), ("stl", "binary", SINGLE),
    ("stl_ascii", "text", 1e-5), ("obj", "text", 1e-5), ("off", "text", 1e-5),
    ("glb", "bytes", SINGLE), ("gltf", "embedded", SINGLE),
]:  # fmt: skip

    @writes("trimesh", f"mesh {suffix} {kind}", suffix[:4].rstrip("_"), close=close, has="m")
    def trimesh_mesh(path: Path, suffix: str = suffix, kind: str = kind) -> None:
        trimesh = need("trimesh")
        made = trimesh.Trimesh(POINTS, FACES, process=False)
        if suffix == "gltf":
            files = trimesh.exchange.gltf.export_gltf(made.scene(), embed_buffers=True)
            path.write_bytes(files["model.gltf"])
            return
        more = {"encoding": kind} if suffix == "ply" else {}
        data = made.export(file_type=suffix, **more)
        path.write_bytes(data.encode() if isinstance(data, str) else data)


for suffix, kind, close in [
    ("ply", "binary", SINGLE), ("ply", "ascii", 1e-5), ("xyz", "text", 1e-5),
    ("xyz", "colours", 1e-5), ("glb", "bytes", SINGLE),
]:  # fmt: skip

    @writes("trimesh", f"points {suffix} {kind}", suffix, close=close, has="c" * (kind != "text"))
    def trimesh_points(path: Path, suffix: str = suffix, kind: str = kind) -> None:
        made = need("trimesh").PointCloud(POINTS, colors=np.c_[COLOURS, np.full(N, 255, "u1")])
        more = {"encoding": kind} if suffix == "ply" else {}
        more |= {"write_colors": kind == "colours"} if suffix == "xyz" else {}
        data = made.export(file_type=suffix, **more)
        path.write_bytes(data.encode() if isinstance(data, str) else data)


for suffix, kind, options, close in [
    ("vtk", "4.2 text", {"file_format": "vtk42", "binary": False}, 0.0),
    ("vtk", "4.2 bytes", {"file_format": "vtk42", "binary": True}, 0.0),
    ("vtk", "5.1 text", {"file_format": "vtk51", "binary": False}, 0.0),
    ("vtk", "5.1 bytes", {"file_format": "vtk51", "binary": True}, 0.0),
    ("vtu", "text", {"binary": False}, 0.0), ("vtu", "base64", {"compression": None}, 0.0),
    ("vtu", "zlib", {"compression": "zlib"}, 0.0), ("vtu", "lzma", {"compression": "lzma"}, 0.0),
    ("ply", "text", {"binary": False}, 0.0), ("ply", "bytes", {"binary": True}, 0.0),
    ("stl", "text", {"binary": False}, SINGLE), ("stl", "bytes", {"binary": True}, SINGLE),
    ("obj", "text", {}, 0.0), ("off", "text", {}, 1e-9),
]:  # fmt: skip

    @writes("meshio", f"{suffix} {kind}", suffix, close=close,
            has="m" + "i" * (suffix in ("vtk", "vtu", "ply")))  # fmt: skip
    def meshio(path: Path, options: dict[str, Any] = options) -> None:
        data = {"intensity": INTENSITY} if path.suffix in (".vtk", ".vtu", ".ply") else {}
        made = need("meshio").Mesh(POINTS, [("triangle", FACES)], point_data=data)
        made.write(path, **options)


def record(code: str = "f8") -> np.ndarray:
    """The points with all that is known of them, field by field."""
    kinds = [*((name, code) for name in AXES), *((name, "u1") for name in RGB)]
    made = np.zeros(N, [*kinds, *((name, "f4") for name in UP), ("intensity", "f4")])
    for names, columns in ((AXES, POINTS), (RGB, COLOURS), (UP, NORMALS)):
        for name, column in zip(names, columns.T, strict=True):
            made[name] = column
    made["intensity"] = INTENSITY
    return made


for kind in ("text", "<", ">"):
    for faces in (False, True):

        @writes("plyfile", f"ply {kind}{' with faces' * faces}", "ply", has="cni" + "m" * faces)
        def plyfile(path: Path, kind: str = kind, faces: bool = faces) -> None:
            plyfile = need("plyfile")
            elements = [plyfile.PlyElement.describe(record(), "vertex")]
            if faces:
                lists = np.empty(len(FACES), [("vertex_indices", "i4", (3,))])
                lists["vertex_indices"] = FACES
                elements.append(plyfile.PlyElement.describe(lists, "face"))
            order = "=" if kind == "text" else kind
            plyfile.PlyData(elements, text=kind == "text", byte_order=order).write(path)


for suffix in ("las", "laz"):
    for kind in (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10):

        @writes("laspy", f"{suffix} {kind}", suffix, close=1e-9,
                has="i" + "c" * (kind in (2, 3, 5, 7, 8, 10)))  # fmt: skip
        def laspy(path: Path, kind: int = kind) -> None:
            laspy = need("laspy")
            header = laspy.LasHeader(point_format=kind, version="1.4" if kind > 5 else "1.3")
            header.scales = np.full(3, 1e-3)
            header.add_extra_dim(laspy.ExtraBytesParams("share", "f8"))
            data = laspy.LasData(header)
            data.x, data.y, data.z = POINTS.T
            data.intensity = np.arange(N) * 128  # of 16 bits
            data.share = INTENSITY
            if "red" in header.point_format.dimension_names:
                data.red, data.green, data.blue = COLOURS.T.astype("u2") * 257
            data.write(path)


for kind, arrays in {
    "points": {}, "colours": {f"color{n}": COLOURS[:, i].copy() for i, n in
                              enumerate(("Red", "Green", "Blue"))},
    "intensity": {"intensity": INTENSITY.astype("f4")},
}.items():  # fmt: skip

    @writes("pye57", f"e57 {kind}", "e57", close=SINGLE, has=kind[0].replace("p", ""))
    def pye57(path: Path, arrays: dict[str, np.ndarray] = arrays) -> None:
        with need("pye57").E57(str(path), "w") as file:
            columns = {f"cartesian{a}": POINTS[:, i].copy() for i, a in enumerate("XYZ")}
            file.write_scan_raw({**columns, **arrays})


for kind, values in {
    "f8": POINTS, "f4": POINTS.astype("f4"), ">f8": POINTS.astype(">f8"),
    "column by column": np.asfortranarray(POINTS), "(3, N)": POINTS.T.copy(),
    "an image": POINTS.reshape(20, 15, 3), "fields": record("f4"),
}.items():  # fmt: skip

    @writes("NumPy", f"npy {kind}", "npy", close=SINGLE, has="cni" if kind == "fields" else "")
    def npy(path: Path, values: np.ndarray = values) -> None:
        np.save(path, values)


for kind, keys in [("points", {}), ("xyz", {}), ("positions", {"compress": True})]:

    @writes("NumPy", f"npz {kind}", "npz")
    def npz(path: Path, kind: str = kind, keys: dict[str, bool] = keys) -> None:
        (np.savez_compressed if keys else np.savez)(path, **{kind: POINTS})


for kind, suffix, more in [
    ("18 digits", "txt", {}), ("3 digits", "xyz", {"fmt": "%.3f"}),
    ("commas", "csv", {"delimiter": ",", "header": "x,y,z", "comments": ""}),
    ("comment", "asc", {"header": "X Y Z", "fmt": "%.3f", "delimiter": "\t"}),
]:  # fmt: skip

    @writes("NumPy", f"savetxt {kind}", suffix)
    def savetxt(path: Path, more: dict[str, Any] = more) -> None:
        np.savetxt(path, POINTS, **more)


for kind, suffix, more in [
    ("commas", "csv", {"index": False}), ("with an index", "csv", {}),
    ("of Central Europe", "csv", {"index": False, "sep": ";", "decimal": ","}),
    ("tabs", "txt", {"index": False, "sep": "\t"}),
    ("all quoted", "csv", {"index": False, "quoting": csv.QUOTE_ALL}),
    ("UTF-16", "csv", {"index": False, "encoding": "utf-16"}),
    ("UTF-8 with a mark", "csv", {"index": False, "encoding": "utf-8-sig"}),
    ("Windows' lines", "csv", {"index": False, "lineterminator": "\r\n"}),
    ("gzip", "csv.gz", {"index": False}), ("ZIP", "csv.zip", {"index": False}),
    ("empty cells", "csv", {"index": False, "na_rep": ""}),
]:  # fmt: skip

    @writes("pandas", f"csv {kind}", suffix, has="cni")
    def to_csv(path: Path, more: dict[str, Any] = more) -> None:
        frame = need("pandas").DataFrame(record())
        frame["intensity"] = INTENSITY
        frame[list(UP)] = NORMALS
        if "na_rep" in more:
            frame["lost"] = np.where(np.arange(N) % 2, np.nan, 1.0)
        frame.to_csv(path, **more)


@writes("NumPy", "npy of objects", "npy", refused="objects|pickle")
def objects(path: Path) -> None:
    np.save(path, POINTS.astype(object))


@writes("NumPy", "npy of pairs", "npy", refused=r"\(300, 2\)")
def pairs(path: Path) -> None:
    np.save(path, POINTS[:, :2])


@writes("NumPy", "npy of complex numbers", "npy", refused="complex")
def complexes(path: Path) -> None:
    np.save(path, POINTS * 1j)


@writes("meshio", "mesh of Medit", "mesh", refused="expected a file ending in")
def medit(path: Path) -> None:
    need("meshio").Mesh(POINTS, [("triangle", FACES)]).write(path)


@writes("pandas", "pickle", "pkl", refused="expected a file ending in")
def pickled(path: Path) -> None:
    need("pandas").DataFrame(record()).to_pickle(path)


@writes("pandas", "csv without coordinates", "csv", refused="at least 3 numbers|x, y")
def no_coordinates(path: Path) -> None:
    need("pandas").DataFrame({"a": COLOURS[:, 0], "b": "c"}).to_csv(path, index=False)
