"""Small good files of every format, made here, and ways to damage them."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from experiments.fuzz.points import FACES, POINTS, rows
from experiments.fuzz.vtk_files import vtk, vtk_mesh, vtk_xml

HEADER = (
    "{columns}\n{rows}\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n"
)  # fmt: skip


def ptx(scans: int = 2) -> bytes:
    scan = HEADER.format(columns=8, rows=5) + rows(" 0.25 1 2 3")
    return (scan * scans).encode()


def pts() -> bytes:
    return ("40\n" + rows(" -20 1 2 3")).encode() * 2


def ply(kind: str) -> bytes:
    header = f"ply\nformat {kind} 1.0\nelement vertex 40\n" + "".join(
        f"property float {axis}\n" for axis in "xyz"
    )
    header += "element face 20\nproperty list uchar int vertex_indices\nend_header\n"
    if kind == "ascii":
        faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES.tolist())
        return (header + rows() + faces).encode()
    order = "<" if "little" in kind else ">"
    record = np.zeros(20, [("n", "u1"), ("corners", f"{order}i4", 3)])
    record["n"], record["corners"] = 3, FACES
    return header.encode() + POINTS.astype(f"{order}f4").tobytes() + record.tobytes()


def pcd(kind: str) -> bytes:
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 40\n"
        f"HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 40\nDATA {kind}\n"
    )
    body = rows().encode() if kind == "ascii" else POINTS.astype("<f4").tobytes()
    return header.encode() + body


def obj() -> bytes:
    faces = "".join(f"f {a + 1}/1 {b + 1} {c + 1}\n" for a, b, c in FACES.tolist())
    return ("".join(f"v {line}\n" for line in rows().splitlines()) + faces).encode()


def off() -> bytes:
    faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES.tolist())
    return ("OFF\n40 20 0\n" + rows() + faces).encode()


def stl(ascii: bool) -> bytes:
    if ascii:
        facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
        corners = "".join(
            facet.format("".join(f"vertex {x} {y} {z}\n" for x, y, z in POINTS[f].tolist()))
            for f in FACES
        )
        return f"solid a\n{corners}endsolid a\n".encode()
    record = np.zeros(20, [("n", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    record["corners"] = POINTS[FACES]
    return bytes(80) + (20).to_bytes(4, "little") + record.tobytes()


def saved(save: Callable[[io.BytesIO], object]) -> bytes:
    stream = io.BytesIO()
    save(stream)
    return stream.getvalue()


def las(kind: int, compressed: bool) -> bytes:
    import laspy

    header = laspy.LasHeader(point_format=kind, version="1.4" if kind > 5 else "1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.array([1.0, 2.0, 3.0])
    header.add_extra_dim(laspy.ExtraBytesParams("amplitude", "f4"))
    data = laspy.LasData(header)
    data.x, data.y, data.z = POINTS.T
    data.intensity = np.arange(40)
    stream = io.BytesIO()
    data.write(stream, do_compress=compressed)
    return stream.getvalue()


def e57(folder: Path) -> bytes:
    import pye57

    path = folder / "good.e57"
    with pye57.E57(str(path), "w") as file:
        columns = {f"cartesian{axis}": POINTS[:, i].copy() for i, axis in enumerate("XYZ")}
        for name in ("a", "b"):
            file.write_scan_raw({**columns, "intensity": np.ones(40, "f4")}, name=name)
    return path.read_bytes()


def zipped(members: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def gltf(suffix: str) -> bytes:
    trimesh: Any = import_module("trimesh")
    scene = trimesh.Scene(trimesh.Trimesh(POINTS, FACES, process=False))
    if suffix == "glb":
        return bytes(scene.export(file_type="glb"))
    export: Any = import_module("trimesh.exchange.gltf")
    return bytes(export.export_gltf(scene, embed_buffers=True)["model.gltf"])


def good_files(folder: Path) -> dict[str, bytes]:
    """By name; those of extras only where these are installed."""
    text = rows().encode()
    found = {
        "ascii.ply": ply("ascii"), "little.ply": ply("binary_little_endian"),
        "big.ply": ply("binary_big_endian"), "ascii.pcd": pcd("ascii"),
        "binary.pcd": pcd("binary"), "a.obj": obj(), "a.off": off(), "ascii.stl": stl(True),
        "binary.stl": stl(False), "a.xyz": text, "a.txt": text, "a.asc": text,
        "a.xyzn": rows(" 0 0 1").encode(), "a.xyzrgb": rows(" 0 0.5 1").encode(),
        "a.csv": b"x,y,z\n" + text.replace(b" ", b","), "plain.pts": text, "a.pts": pts(),
        "a.ptx": ptx(), "a.npy": saved(lambda file: np.save(file, POINTS)),
        "a.npz": saved(lambda file: np.savez_compressed(file, points=POINTS)),
        "ascii.vtk": vtk("ASCII"), "binary.vtk": vtk("BINARY"),
        "mesh.vtk": vtk_mesh("ASCII"), "new.vtk": vtk_mesh("BINARY"), "a.vtp": vtk_xml("vtp"),
        "a.vtu": vtk_xml("vtu"),
        "old.las": las(3, False), "new.las": las(7, False), "old.laz": las(1, True),
        "new.laz": las(6, True), "a.ptx.gz": gzip.compress(ptx(), mtime=0),
        "a.zip": zipped({"a.ptx": ptx(), "b/c.xyz": text, "notes.pdf": b"%"}),
    }  # fmt: skip
    if find_spec("pye57"):
        found["a.e57"] = e57(folder)
    if find_spec("trimesh"):
        found |= {"a.glb": gltf("glb"), "a.gltf": gltf("gltf")}
    return found


_WORDS = (b"nan", b"-1", b"0", b"1e999", b"99999999999", b"4294967295", b"\n", b"\r", b" ", b"\0",
          b"#", b",", b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x7f")  # fmt: skip


def damaged(content: bytes, rng: np.random.Generator, head: int = 400) -> bytes:
    """Cut off, with bytes changed, words put in or taken out: more often in the header."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        span = min(len(data), head) if rng.random() < 0.6 else len(data)
        at = int(rng.integers(0, span + 1))
        match int(rng.integers(0, 6)):
            case 0:
                del data[at:]
            case 1:
                data[at : at + 1] = bytes([int(rng.integers(0, 256))])
            case 2:
                word = _WORDS[int(rng.integers(0, len(_WORDS)))]
                data[at : at + int(rng.integers(0, 1 + len(word)))] = word
            case 3:
                del data[at : at + int(rng.integers(1, 40))]
            case 4:
                data[at:at] = data[at : at + int(rng.integers(1, 200))]
            case 5 if at < len(data):
                data[at] ^= 1 << int(rng.integers(0, 8))
    return bytes(data)
