"""Files in the manner of programs that are no Python packages: as their manuals have them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from writer_variants import COLOURS, FACES, INTENSITY, NORMALS, POINTS, Variant

MANNER: list[Variant] = []
#: Of points, columns by columns.
SHARE = INTENSITY[:, None]
PTX_HEAD = "300\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"


def table(*columns: np.ndarray, sep: str = " ", comma: bool = False) -> str:
    """Rows of numbers as they are."""
    rows = zip(*(np.asarray(each).reshape(len(POINTS), -1).tolist() for each in columns),
               strict=True)  # fmt: skip
    text = "".join(sep.join(str(v) for part in row for v in part) + "\n" for row in rows)
    return text.replace(".", ",") if comma else text


def like(
    program: str, what: str, suffix: str, content: str | bytes, has: str = "", close: float = 0.0
) -> None:
    """Register a file."""
    data = content.encode() if isinstance(content, str) else content

    def write(path: Path) -> object:
        return path.write_bytes(data)

    MANNER.append(Variant(program, what, suffix, write, close, has))


def ply(comments: Iterable[str], properties: Iterable[str], body: str | bytes, kind: str) -> bytes:
    head = ["ply", f"format {kind} 1.0", *comments, f"element vertex {len(POINTS)}"]
    lines = [*head, *(f"property {each}" for each in properties), "end_header", ""]
    return "\n".join(lines).encode() + (body.encode() if isinstance(body, str) else body)


FLOATS = [f"float {axis}" for axis in "xyz"]
BYTES = [f"uchar {colour}" for colour in ("red", "green", "blue")]
SINGLE = POINTS.astype("<f4")


def records(kind: str, *columns: np.ndarray) -> bytes:
    """Rows of bytes, each column (N,) in its type."""
    table = np.zeros(len(POINTS), kind)
    for name, column in zip(table.dtype.names or (), columns, strict=True):
        table[name] = column
    return table.tobytes()


# Tables of text.
like("CloudCompare", "ASCII, // heading", "asc",
     "//X Y Z R G B Intensity\n" + table(POINTS, COLOURS, SHARE), "ci")  # fmt: skip
like("CloudCompare", "ASCII, heading and count", "txt",
     "//X,Y,Z,Intensity\n300\n" + table(POINTS, SHARE, sep=","), "i")  # fmt: skip
like("CloudCompare", "ASCII, semicolons, normals", "csv",
     "//X;Y;Z;Nx;Ny;Nz\n" + table(POINTS, NORMALS, sep=";"), "n")  # fmt: skip
like("FARO SCENE", "XYZ with colours", "xyz", table(POINTS, COLOURS), "c")
like("RiSCAN PRO", "ASCII with units", "txt",
     "X[m],Y[m],Z[m],Intensity[]\n" + table(POINTS, SHARE, sep=","), "i")  # fmt: skip
like("RiSCAN PRO", "ASCII, tabs, index first", "asc",
     "ID\tX\tY\tZ\n" + table(np.arange(300), POINTS, sep="\t"))  # fmt: skip
like("RealWorks", "ASC, intensity and colours", "asc",
     table(POINTS, np.arange(300), COLOURS), "c")  # fmt: skip
like("Excel, German", "CSV, decimal commas", "csv",
     "Rechtswert;Hochwert;Höhe;Intensity\r\n"
     + table(POINTS, SHARE, sep=";", comma=True).replace("\n", "\r\n"), "i")  # fmt: skip
like("Excel", "text in UTF-16", "txt",
     ("X\tY\tZ\n" + table(POINTS, sep="\t")).encode("utf-16"))  # fmt: skip
like("QGIS", "CSV with names of places", "csv",
     "name,x,y,z\n" + "".join(f'"place {k}",{row}\n'
     for k, row in enumerate(table(POINTS, sep=",").splitlines())))  # fmt: skip
# Leica's own.
like("Cyclone", "PTS", "pts", "300\n" + table(POINTS, np.arange(300) - 150, COLOURS), "c")
like("Cyclone", "PTX with intensity", "ptx", PTX_HEAD + table(POINTS, SHARE), "i")
like("Cyclone", "PTX with colours", "ptx", PTX_HEAD + table(POINTS, SHARE, COLOURS), "ci")
like("Cyclone", "PTX, end of lines of Windows", "ptx",
     (PTX_HEAD + table(POINTS, SHARE)).replace("\n", "\r\n"), "i")  # fmt: skip
# PCL.
FIELDS = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 300\nHEIGHT 1\n"
like("PCL", "PCD .5", "pcd", f"# .PCD v.5 - Point Cloud Data file format\nVERSION .5\n{FIELDS}"
     f"POINTS 300\nDATA ascii\n{table(POINTS)}", close=1e-6)  # fmt: skip
like("PCL", "PCD .6", "pcd", f"# .PCD v.6 - Point Cloud Data file format\nVERSION .6\n{FIELDS}"
     f"POINTS 300\nDATA ascii\n{table(POINTS)}", close=1e-6)  # fmt: skip
like("PCL", "PCD .7, packed colours", "pcd",
     b"VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 300\n"
     b"HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 300\nDATA binary\n"
     + records("f4,f4,f4,u4", *SINGLE.T, COLOURS @ [1 << 16, 1 << 8, 1]), "c", 1e-6)  # fmt: skip
like("PCL", "PCD .7, organised, padded", "pcd",
     b"VERSION .7\nFIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\nWIDTH 20\nHEIGHT 15\n"
     b"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 300\nDATA binary\n"
     + records("f4,f4,f4,u4", *SINGLE.T, np.zeros(300)), close=1e-6)  # fmt: skip
# PLY of several programs.
like("MeshLab", "PLY, quality", "ply", ply(
    ["comment VCGLIB generated"], [*FLOATS, *BYTES, "uchar alpha", "float quality"],
    records("f4,f4,f4,u1,u1,u1,u1,f4", *SINGLE.T, *COLOURS.T, 255, 0.5), "binary_little_endian"),
    "c", 1e-6)  # fmt: skip
like("CloudCompare", "PLY, scalar field", "ply", ply(
    ["comment Created by CloudCompare", "obj_info Generated by CloudCompare!"],
    [f"double {axis}" for axis in "xyz"] + ["float scalar_Intensity"],
    records("f8,f8,f8,f4", *POINTS.T, INTENSITY), "binary_little_endian"))  # fmt: skip
like("Metashape", "PLY, diffuse colours", "ply", ply(
    [], [*FLOATS, *(f"uchar diffuse_{c}" for c in ("red", "green", "blue"))],
    table(POINTS, COLOURS), "ascii"), "c", 1e-6)  # fmt: skip
like("Stanford", "PLY, big endian, obj_info", "ply", ply(
    ["obj_info num_cols 512", "obj_info num_rows 400"], FLOATS,
    POINTS.astype(">f4").tobytes(), "binary_big_endian"), close=1e-6)  # fmt: skip
like("Blender", "PLY, normals and textures", "ply", ply(
    ["comment Created in Blender version 4.2"],
    [*FLOATS, "float nx", "float ny", "float nz", "float s", "float t"],
    records("f4,f4,f4,f4,f4,f4,f4,f4", *SINGLE.T, *NORMALS.T, 0, 0), "binary_little_endian"),
    "n", 1e-6)  # fmt: skip
# Meshes.
CORNERS = " ".join(map(str, FACES.ravel().tolist()))
FACE_LINES = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES.tolist())
like("MeshLab", "OBJ, colours of vertices", "obj",
     "# OBJ File Generated by Meshlab\n" + "".join(f"v {row}\n"
     for row in table(POINTS, (COLOURS / 255).round(6)).splitlines()) + FACE_LINES,
     "cm")  # fmt: skip
like("Rhino", "OBJ, indices from the end", "obj",
     "".join(f"v {x} {y} {z}\nv {u} {v} {w}\nv {r} {s} {t}\nf -3 -2 -1\n"
     for (x, y, z), (u, v, w), (r, s, t) in POINTS.reshape(-1, 3, 3).tolist()), "m")  # fmt: skip
like("Geomview", "COFF", "off", f"COFF\n300 100 0\n{table(POINTS, COLOURS, np.full(300, 255))}"
     + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES.tolist()), "m")  # fmt: skip
like("ParaView", "VTK, scalars of points and cells", "vtk",
     f"# vtk DataFile Version 3.0\nvtk output\nASCII\nDATASET POLYDATA\nPOINTS 300 double\n"
     f"{table(POINTS)}POLYGONS 100 400\n"
     + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES.tolist())
     + "CELL_DATA 100\nSCALARS area float\nLOOKUP_TABLE default\n" + "1\n" * 100
     + "POINT_DATA 300\nSCALARS intensity double\nLOOKUP_TABLE default\n" + table(SHARE),
     "im")  # fmt: skip
like("ParaView", "VTP in text, data of cells", "vtp",
     '<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData><Piece NumberOfPoints="300" '
     'NumberOfPolys="100"><CellData><DataArray type="Float32" Name="area" format="ascii">'
     + "1 " * 100 + '</DataArray></CellData><PointData><DataArray type="Float64" Name="intensity" '
     f'format="ascii">{table(SHARE)}</DataArray></PointData><Points><DataArray type="Float64" '
     f'NumberOfComponents="3" format="ascii">{table(POINTS)}</DataArray></Points><Polys>'
     f'<DataArray type="Int64" Name="connectivity" format="ascii">{CORNERS}</DataArray>'
     '<DataArray type="Int64" Name="offsets" format="ascii">'
     + " ".join(str(3 * k) for k in range(1, 101))
     + "</DataArray></Polys></Piece></PolyData></VTKFile>", "im")  # fmt: skip
