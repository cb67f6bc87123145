"""VTK's files: legacy and XML, points with their data, and meshes."""

from __future__ import annotations

import base64
import struct
import zlib
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.io import PointCloud, read_cloud
from mvreg.io.vtk import read_vtk
from mvreg.io.vtk_xml import read_vtk_xml

N = 6
POINTS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.5], [4, 0, 0], [4, 1, 0.25]])
POINTS = POINTS + np.array([600_000.0, 5_000_000.0, 100.0])
COLOURS = (np.arange(3 * N).reshape(N, 3) * 14).astype("u1")
NORMALS = np.tile([0.0, 0.0, 1.0], (N, 1))
QUADS = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
HALVES = [[0, 1, 2], [1, 4, 5], [0, 2, 3], [1, 5, 2]]


def written(values: Any, kind: str, binary: bool) -> bytes:
    """Numbers as a legacy file has them."""
    values = np.asarray(values)
    if binary:
        return values.astype(">" + kind).tobytes() + b"\n"
    return b" ".join(repr(v).encode() for v in values.ravel().tolist()) + b"\n"


def legacy(binary: bool, cells: bytes, data: bytes = b"", dataset: str = "POLYDATA") -> bytes:
    kind = "BINARY" if binary else "ASCII"
    head = f"# vtk DataFile Version 4.2\na\n{kind}\nDATASET {dataset}\nPOINTS {N} double\n"
    return head.encode() + written(POINTS, "f8", binary) + cells + data


def point_data(binary: bool) -> bytes:
    """Data of all kinds, between what is to be left out."""
    shares = COLOURS if binary else COLOURS / 255
    return b"".join([
        b"METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n",
        b"CELL_DATA 2\nSCALARS area double 1\nLOOKUP_TABLE default\n",
        written([2.0, 2.0], "f8", binary),
        b"POINT_DATA 6\nCOLOR_SCALARS shade 3\n", written(shares, "u1", binary),
        b"NORMALS up float\n", written(NORMALS, "f4", binary),
        b"VECTORS flow double\n", written(POINTS, "f8", binary),
        b"LOOKUP_TABLE mine 1\n", written([0] * 4, "u1", binary),
        b"TEXTURE_COORDINATES uv 2 float\n", written(POINTS[:, :2], "f4", binary),
        b"FIELD FieldData 3\nIntensity 1 6 float\n", written(np.arange(6) / 8, "f4", binary),
        b"with%20blank 1 6 int\n", written(np.arange(6), "i4", binary),
        b"half 1 3 short\n", written([1, 2, 3], "i2", binary),
    ])  # fmt: skip


@pytest.mark.parametrize("binary", [False, True])
def test_legacy_data_of_points(tmp_path: Path, binary: bool) -> None:
    (tmp_path / "a.vtk").write_bytes(legacy(binary, b"", point_data(binary)))
    cloud = read_vtk(tmp_path / "a.vtk")
    np.testing.assert_array_equal(cloud.points, POINTS)
    found = cloud.attributes
    for i, name in enumerate(("red", "green", "blue")):
        np.testing.assert_array_equal(found[name], COLOURS[:, i])
        assert found[name].dtype == np.uint8
    np.testing.assert_array_equal(found["nz"], np.ones(N))
    np.testing.assert_array_equal(found["flow_1"], POINTS[:, 1])
    np.testing.assert_array_equal(found["intensity"], np.arange(N) / 8)
    np.testing.assert_array_equal(found["with blank"], np.arange(N))
    assert found["with blank"].dtype == np.int32
    assert {"uv_0", "uv_1"} <= found.keys()
    assert cloud.triangles is None
    assert cloud.remarks == ("left out data of cells: area", "left out data of points: half")


def polygons(binary: bool) -> bytes:
    return b"POLYGONS 2 10\n" + written(np.c_[[4, 4], QUADS], "i4", binary)


def offsets(binary: bool) -> bytes:
    return b"".join([
        b"POLYGONS 3 8\nOFFSETS vtktypeint64\n", written([0, 4, 8], "i8", binary),
        b"CONNECTIVITY vtktypeint64\n", written(QUADS, "i8", binary),
    ])  # fmt: skip


def strips(binary: bool) -> bytes:
    return b"TRIANGLE_STRIPS 1 7\n" + written([6, 0, 3, 1, 2, 4, 5], "i4", binary)


def mixed(binary: bool) -> bytes:
    return b"POLYGONS 3 13\n" + written([3, 0, 1, 2, 3, 0, 2, 3, 4, 1, 4, 5, 2], "i4", binary)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("cells", [polygons, offsets, strips, mixed])
def test_legacy_faces_are_sampled(tmp_path: Path, binary: bool, cells: Any) -> None:
    data = legacy(binary, b"LINES 1 3\n" + written([2, 0, 1], "i4", binary) + cells(binary))
    (tmp_path / "a.vtk").write_bytes(data)
    check_sampled(tmp_path / "a.vtk", ("left out what has no surface: 1 lines",))


def check_sampled(path: Path, remarks: tuple[str, ...] = ()) -> None:
    cloud = read_cloud(path)
    assert cloud.remarks[:-1] == remarks
    assert cloud.remarks[-1].startswith("6 vertices, sampled at 20,000 points on 4 triangles")
    np.testing.assert_allclose(cloud.points.max(axis=0), POINTS.max(axis=0), atol=0.05)
    flat = cloud.points[:, :2] - POINTS[0, :2]
    share = np.histogram2d(*flat.T, bins=4, range=[[0, 4], [0, 1]])[0] / len(flat)
    np.testing.assert_allclose(share, 1 / 16, atol=0.015)


def test_strips_and_pixels_keep_their_orientation(tmp_path: Path) -> None:
    cells = [[5, 0, 3, 1, 2, 4], [4, 1, 4, 2, 5], [4, 0, 1, 2, 3], [3, 0, 1, 2]]
    flat = [number for cell in cells for number in cell]
    data = (
        legacy(False, b"", dataset="UNSTRUCTURED_GRID")
        + f"CELLS 4 {len(flat)}\n{' '.join(map(str, flat))}\nCELL_TYPES 4\n6 8 10 22\n".encode()
    )
    (tmp_path / "a.vtk").write_bytes(data)
    cloud = read_vtk(tmp_path / "a.vtk")
    found = {tuple(t) for t in cloud.triangles.tolist()}
    strip = {(0, 3, 1), (3, 2, 1), (1, 2, 4)}
    assert found == strip | {(1, 4, 5), (1, 5, 2), (0, 1, 2)}
    assert cloud.remarks == ("left out what has no surface: 1 tetrahedra",)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (b"POLYGONS 2 10\n4 0 1 2 3 4 1 4 5\n", "corners of cells, 10 numbers; found 18 bytes"),
        (b"POLYGONS 3 10\n4 0 1 2 3 4 1 4 5 2\n", "expected 3 cells in 10 numbers, found 2"),
        (b"POLYGONS 2 10\n4 0 1 2 3 4 1 4 5 6\n", "expected corners 0 to 5, got 6"),
        (b"POLYGONS 2 4\nOFFSETS int\n0 5\nCONNECTIVITY int\n0 1 2 3\n", "at 4 corners, got"),
        (b"POLYGONS 99999999 999999999\n", "truncated"),
        (b"POINT_DATA 7\n", "POINT_DATA 6, as many as there are POINTS"),
        (b"POINT_DATA 6\nSCALARS a real\n", "of a type char"),
        (b"POINT_DATA 6\nSCALARS a float 99\n", "1 to 64 components, got '99'"),
        (b"POINT_DATA 6\nSCALARS a float\nLOOKUP_TABLE default\n1 2 3\n", "found 3 numbers|bytes"),
        (b"7 8 9\n", "expected one of DATASET"),
        (b"CELLS 1 2\n1 0\nCELL_TYPES 2\n1 1\n", "the types of 1 cells, got 2"),
    ],
)
def test_damaged_legacy_files(tmp_path: Path, cells: bytes, message: str) -> None:
    (tmp_path / "a.vtk").write_bytes(legacy(False, cells))
    with pytest.raises(InputError, match=rf"a\.vtk.*{message}"):
        read_cloud(tmp_path / "a.vtk")


def test_kinds_that_are_no_scans_are_refused_by_name(tmp_path: Path) -> None:
    head = "# vtk DataFile Version 3.0\na\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n"
    (tmp_path / "a.vtk").write_text(head)
    with pytest.raises(InputError, match=r"line 4: expected DATASET POLYDATA.*convert"):
        read_cloud(tmp_path / "a.vtk")
    (tmp_path / "a.vtp").write_text('<VTKFile type="ImageData"></VTKFile>')
    with pytest.raises(InputError, match=r"type PolyData, UnstructuredGrid; got 'VTKFile' of"):
        read_cloud(tmp_path / "a.vtp")


class Writer:
    """A PolyData file written by the definition of the format."""

    def __init__(self, mode: str, compressed: bool, header: str, order: str) -> None:
        self.mode, self.compressed, self.header, self.order = mode, compressed, header, order
        self.appended = b""

    def packed(self, values: np.ndarray) -> list[bytes]:
        """Header and data, encoded apart where they are compressed."""
        item, data = self.order + {"u4": "I", "u8": "Q"}[self.header], values.tobytes()
        if not self.compressed:
            return [struct.pack(item, len(data)) + data]
        blocks = [data[i : i + 40] for i in range(0, len(data), 40)]
        small = [zlib.compress(block) for block in blocks]
        sizes = [len(blocks), 40, len(data) % 40, *map(len, small)]
        return [b"".join(struct.pack(item, size) for size in sizes), b"".join(small)]

    def array(self, name: str, kind: str, values: Any, more: str = "") -> str:
        code = {"Float64": "f8", "Float32": "f4", "UInt8": "u1", "Int64": "i8"}[kind]
        values = np.ascontiguousarray(values, self.order + code)
        more += f' NumberOfComponents="{values.shape[1] if values.ndim > 1 else 1}"'
        head = f'<DataArray type="{kind}" Name="{name}" {more}'
        if self.mode == "ascii":
            return (
                f'{head} format="ascii">{" ".join(map(repr, values.ravel().tolist()))}</DataArray>'
            )
        parts = self.packed(values)
        if self.mode == "binary":
            text = "".join(base64.b64encode(part).decode() for part in parts)
            return f'{head} format="binary">\n  {text}\n</DataArray>'
        offset = len(self.appended)
        encode = bytes if self.mode == "raw" else base64.b64encode
        self.appended += b"".join(encode(part) for part in parts)
        return f'{head} format="appended" offset="{offset}"/>'

    def piece(self) -> str:
        more = '<Array type="String" Name="words" format="ascii">48 0</Array>'
        return "".join([
            f'<Piece NumberOfPoints="{N}" NumberOfPolys="2"><PointData Normals="up" Scalars="s">',
            self.array("s", "UInt8", COLOURS), self.array("up", "Float32", NORMALS),
            self.array("Intensity", "Float32", np.arange(N) / 8), more, "</PointData><CellData>",
            self.array("area", "Float64", [2, 2]), "</CellData><Points>",
            self.array("Points", "Float64", POINTS), "</Points><Polys>",
            self.array("connectivity", "Int64", QUADS.ravel()),
            self.array("offsets", "Int64", [4, 8]),
            "</Polys></Piece>",
        ])  # fmt: skip

    def file(self, pieces: int = 1) -> bytes:
        order = "LittleEndian" if self.order == "<" else "BigEndian"
        how = 'compressor="vtkZLibDataCompressor"' if self.compressed else ""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="{order}" '
            f'header_type="{"UInt64" if self.header == "u8" else "UInt32"}" {how}><PolyData>'
        )
        body = "".join(self.piece() for _ in range(pieces))
        text = f"{head}{body}</PolyData>".encode()
        if self.appended:
            encoding = b"raw" if self.mode == "raw" else b"base64"
            text += b'<AppendedData encoding="' + encoding + b'">\n   _' + self.appended
            text += b"\n  </AppendedData>"
        return text + b"</VTKFile>"


VARIANTS = [
    *product(("binary", "raw", "base64"), (False, True), ("u4", "u8"), "<>"),
    ("ascii", False, "u4", "<"),
]


@pytest.mark.parametrize("variant", VARIANTS)
def test_xml(tmp_path: Path, variant: tuple[Any, ...]) -> None:
    path = tmp_path / "a.vtp"
    path.write_bytes(Writer(*variant).file(pieces=2))
    cloud = read_vtk_xml(path)
    np.testing.assert_array_equal(cloud.points, [*POINTS, *POINTS])
    np.testing.assert_array_equal(cloud.attributes["green"], [*COLOURS[:, 1], *COLOURS[:, 1]])
    np.testing.assert_array_equal(cloud.attributes["nz"], np.ones(2 * N))
    np.testing.assert_array_equal(cloud.attributes["intensity"], [*np.arange(N) / 8] * 2)
    assert cloud.triangles.tolist() == [*HALVES, *(np.array(HALVES) + N).tolist()]
    left_out = "left out data of cells or of some points: words, area"
    assert cloud.remarks == (left_out,)
    path.write_bytes(Writer(*variant).file())
    check_sampled(path, (left_out,))


@pytest.mark.parametrize("variant", VARIANTS)
def test_xml_cut_off(tmp_path: Path, variant: tuple[Any, ...]) -> None:
    whole = Writer(*variant).file()
    for part in (0.2, 0.5, 0.7, 0.9):
        (tmp_path / "a.vtp").write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(InputError, match=r"truncated|damaged"):
            read_cloud(tmp_path / "a.vtp")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("vtkZLib", "vtkLZ4", r"compressor vtkZLib.*got 'vtkLZ4.*write the file again"),
        ("UInt32", "UInt16", "header_type UInt32, UInt64; got 'UInt16'"),
        ("Points=\"6\"", "Points=\"7\"", "the coordinates of 7 points"),
        ("<?xml version=\"1.0\"?>", "<!DOCTYPE a []>", "without entities"),
    ],
)  # fmt: skip
def test_xml_that_cannot_be_read(tmp_path: Path, old: str, new: str, message: str) -> None:
    whole = Writer("binary", True, "u4", "<").file()
    assert old.encode() in whole
    (tmp_path / "a.vtp").write_bytes(whole.replace(old.encode(), new.encode()))
    with pytest.raises(InputError, match=message):
        read_cloud(tmp_path / "a.vtp")


def test_a_few_bytes_do_not_become_gigabytes(tmp_path: Path) -> None:
    bomb = zlib.compress(bytes(30_000_000))
    text = base64.b64encode(struct.pack("<4I", 1, 30_000_000, 0, len(bomb))).decode()
    text += base64.b64encode(bomb).decode()
    (tmp_path / "a.vtp").write_text(
        '<VTKFile type="PolyData" compressor="vtkZLibDataCompressor"><PolyData><Piece '
        'NumberOfPoints="1250000"><Points><DataArray type="Float64" NumberOfComponents="3" '
        f'format="binary">{text}</DataArray></Points></Piece></PolyData></VTKFile>'
    )
    with pytest.raises(InputError, match="30000000 bytes are announced, expected at most"):
        read_cloud(tmp_path / "a.vtp")


MESHIO = [("vtk", "vtk42", b, {}) for b in (0, 1)] + [("vtk", "vtk51", b, {}) for b in (0, 1)]
MESHIO += [("vtu", "vtu", 0, {})]
MESHIO += [("vtu", "vtu", 1, {"compression": c}) for c in (None, "zlib", "lzma")]


@pytest.mark.parametrize(("suffix", "kind", "binary", "more"), MESHIO)
def test_meshio(tmp_path: Path, suffix: str, kind: str, binary: int, more: dict[str, Any]) -> None:
    meshio = pytest.importorskip("meshio", reason="NOT TESTED: meshio is not installed")
    data = {"normals": NORMALS, "intensity": np.arange(N) / 8}
    mesh = meshio.Mesh(POINTS, [("quad", QUADS)], point_data=data)
    path = tmp_path / f"a.{suffix}"
    mesh.write(path, file_format=kind, binary=bool(binary), **more)
    found = (read_vtk if suffix == "vtk" else read_vtk_xml)(path)
    np.testing.assert_array_equal(found.points, POINTS)
    np.testing.assert_array_equal(found.attributes["nz"], np.ones(N))
    np.testing.assert_array_equal(found.attributes["intensity"], np.arange(N) / 8)
    check_sampled(path)


def poly_data(vtk: Any) -> Any:
    from vtk.util.numpy_support import numpy_to_vtk

    def array(values: np.ndarray, name: str) -> Any:
        made = numpy_to_vtk(values, deep=1)
        made.SetName(name)
        return made

    data, points, faces = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetDataTypeToDouble()
    points.SetData(array(POINTS, "points"))
    data.SetPoints(points)
    for quad in QUADS.tolist():
        faces.InsertNextCell(4, quad)
    data.SetPolys(faces)
    data.GetPointData().SetScalars(array(COLOURS, "shade"))
    data.GetPointData().AddArray(array(np.arange(N) / 8, "Intensity"))
    return data


def check_vtk(cloud: PointCloud, tolerance: float) -> None:
    np.testing.assert_allclose(cloud.points, POINTS, rtol=0, atol=tolerance)
    np.testing.assert_array_equal(cloud.attributes["blue"], COLOURS[:, 2])
    np.testing.assert_array_equal(cloud.attributes["intensity"], np.arange(N) / 8)
    assert cloud.triangles.tolist() == HALVES


def test_vtk_itself(tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtk", reason="NOT TESTED: vtk is not installed")
    for version, kind in product((42, 51), (1, 2)):
        writer = vtk.vtkPolyDataWriter()
        writer.SetInputData(poly_data(vtk))
        writer.SetFileVersion(version)
        writer.SetFileType(kind)
        writer.SetFileName(str(tmp_path / "a.vtk"))
        assert writer.Write()
        check_vtk(read_vtk(tmp_path / "a.vtk"), 0 if kind == 2 else 1e-3)  # text has six digits
    for mode, encoded, compressed in product((0, 1, 2), (0, 1), (0, 1)):
        writer = vtk.vtkXMLPolyDataWriter()
        writer.SetInputData(poly_data(vtk))
        writer.SetDataMode(mode)
        writer.SetEncodeAppendedData(encoded)
        writer.SetCompressorType(compressed)  # none or zlib
        writer.SetFileName(str(tmp_path / "a.vtp"))
        assert writer.Write()
        check_vtk(read_vtk_xml(tmp_path / "a.vtp"), 0)
