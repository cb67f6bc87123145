"""Small good files of VTK, legacy and XML."""

from __future__ import annotations

import base64
import zlib

import numpy as np

from experiments.fuzz.points import FACES, POINTS, rows
from mvreg.types.attributes import Values


def vtk(kind: str) -> bytes:
    header = f"# vtk DataFile Version 3.0\na\n{kind}\nDATASET POLYDATA\nPOINTS 40 double\n"
    body = rows().encode() if kind == "ASCII" else POINTS.astype(">f8").tobytes()
    return header.encode() + body + b"\nPOINT_DATA 40\n"


def vtk_mesh(kind: str) -> bytes:
    """With faces and data, as version 4.2 in text and 5.1 in bytes."""
    faces, scalars = np.c_[np.full(20, 3), FACES], np.arange(40)
    if kind == "ASCII":
        text = "POLYGONS 20 80\n" + "".join(f"{' '.join(map(str, f))}\n" for f in faces.tolist())
        fields = f"FIELD f 1\na%20b 1 40 int\n{' '.join(map(str, scalars.tolist()))}\n"
        return vtk(kind).replace(b"\nPOINT_DATA", f"\n{text}POINT_DATA".encode()) + fields.encode()
    cells = (
        b"POLYGONS 21 60\nOFFSETS vtktypeint64\n" + np.arange(0, 61, 3).astype(">i8").tobytes()
        + b"\nCONNECTIVITY vtktypeint64\n" + FACES.astype(">i8").tobytes() + b"\n"
    )  # fmt: skip
    data = b"SCALARS a float\nLOOKUP_TABLE default\n" + scalars.astype(">f4").tobytes()
    return vtk(kind).replace(b"\nPOINT_DATA", b"\n" + cells + b"POINT_DATA") + data + b"\n"


def vtk_xml(suffix: str) -> bytes:
    """Compressed in base64 for ``vtu``; appended as bytes for ``vtp``."""
    appended = b""

    def array(name: str, kind: str, values: Values, components: int = 1) -> str:
        nonlocal appended
        head = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        data = values.tobytes()
        if suffix == "vtp":
            place = len(appended)
            appended += len(data).to_bytes(4, "little") + data
            return f'{head}format="appended" offset="{place}"/>'
        small = zlib.compress(data)
        sizes = b"".join(n.to_bytes(4, "little") for n in (1, len(data), 0, len(small)))
        text = base64.b64encode(sizes) + base64.b64encode(small)
        return f'{head}format="binary">{text.decode()}</DataArray>'

    kind, cells, packed = {
        "vtp": ("PolyData", "Polys", ""),
        "vtu": ("UnstructuredGrid", "Cells", 'compressor="vtkZLibDataCompressor"'),
    }[suffix]
    xml = f'<VTKFile type="{kind}" byte_order="LittleEndian" {packed}><{kind}>'
    xml += '<Piece NumberOfPoints="40"><PointData>'
    xml += array("a", "Int32", np.arange(40, dtype="<i4")) + "</PointData><Points>"
    xml += array("p", "Float64", POINTS.astype("<f8"), 3) + f"</Points><{cells}>"
    xml += array("connectivity", "Int64", FACES.astype("<i8"))
    xml += array("offsets", "Int64", np.arange(3, 61, 3).astype("<i8"))
    xml += array("types", "UInt8", np.full(20, 5, "u1")) + f"</{cells}></Piece></{kind}>"
    end = b'<AppendedData encoding="raw">_' + appended + b"</AppendedData>" if appended else b""
    return xml.encode() + end + b"</VTKFile>"
