"""What a file format is to mvreg, and the formats that it brings; plugins may bring more."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.arrays import read_npy
from mvreg.io.cloud import PointCloud
from mvreg.io.e57 import e57_pieces, read_e57
from mvreg.io.gltf import read_gltf
from mvreg.io.las import las_pieces, read_las
from mvreg.io.obj import read_obj
from mvreg.io.off import read_off
from mvreg.io.pcd import read_pcd
from mvreg.io.pcd_pieces import pcd_pieces
from mvreg.io.pieces import Pieces
from mvreg.io.ply import read_ply
from mvreg.io.ply_pieces import ply_pieces
from mvreg.io.pts import read_pts
from mvreg.io.ptx import read_ptx
from mvreg.io.station_pieces import pts_pieces, ptx_pieces
from mvreg.io.stl import read_stl
from mvreg.io.text import read_text, text_pieces
from mvreg.io.vtk import read_vtk
from mvreg.io.vtk_xml import read_vtk_xml
from mvreg.types import Array
from mvreg.types.attributes import COLOURS, NORMALS


@dataclass(frozen=True)
class ReadOptions:
    """What a user may say of all files of a folder.

    Parameters
    ----------
    columns : tuple of str
        For tables of text: the names of the columns, in order, such as ``time, x, y, z,
        intensity``; empty to go by the header.
    """

    columns: tuple[str, ...] = ()


#: A reader: all scans in a file, in its order, one at a time where the file is large. Raises
#: `InputError` with file, place and reason.
Reader = Callable[[Path, ReadOptions], Iterable[PointCloud]]


@dataclass(frozen=True)
class Format:
    """One file format.

    Parameters
    ----------
    name : str
        As people call it: ``PTX``.
    suffixes : tuple of str
        In lower case, with the point.
    read : callable
        ``read(path, options)``: the scans in a file, see `Reader`.
    pieces : callable, optional
        ``pieces(path, options)``: the scans of a file, each piece by piece, see `Pieces`, or
        `NotInPiecesError`. The next scan is asked for once all pieces of one are read.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Reader
    pieces: Callable[[Path, ReadOptions], Iterable[Pieces]] | None = None


def several(reader: Callable[[Path], Iterable[PointCloud]]) -> Reader:
    """A reader of files that may hold several scans, from a function of the path alone."""

    def read(path: Path, options: ReadOptions) -> Iterable[PointCloud]:
        return reader(path)

    return read


def single(reader: Callable[[Path], Array | PointCloud]) -> Reader:
    """A reader of files that hold one scan, from a function of the path alone."""

    def read(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
        found = reader(path)
        return (found if isinstance(found, PointCloud) else PointCloud(found),)

    return read


def text(name: str, suffixes: tuple[str, ...], columns: Sequence[str] = ()) -> Format:
    """Tables of text whose columns are these, unless the user says otherwise."""

    def read(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
        return (read_text(path, options.columns or columns),)

    def pieces(path: Path, options: ReadOptions) -> Sequence[Pieces]:
        return (text_pieces(path, options.columns or columns),)

    return Format(name, suffixes, read, pieces)


#: The formats that come with mvreg.
FORMATS: tuple[Format, ...] = (
    Format("PLY", (".ply",), single(read_ply), lambda path, options: [ply_pieces(path)]),
    Format("PCD", (".pcd",), single(read_pcd), lambda path, options: [pcd_pieces(path)]),
    Format("OBJ", (".obj",), single(read_obj)),
    Format("OFF", (".off",), single(read_off)),
    Format("STL", (".stl",), single(read_stl)),
    text("text", (".xyz", ".txt", ".csv", ".asc")),
    text("text with normals", (".xyzn",), (*"xyz", *NORMALS)),
    text("text with colours", (".xyzrgb",), (*"xyz", *COLOURS)),
    Format(
        "PTS",
        (".pts",),
        lambda path, options: read_pts(path, options.columns),
        lambda path, options: pts_pieces(path, options.columns),
    ),
    Format("PTX", (".ptx",), several(read_ptx), lambda path, options: ptx_pieces(path)),
    Format("LAS", (".las", ".laz"), single(read_las), lambda path, options: [las_pieces(path)]),
    Format("E57", (".e57",), several(read_e57), lambda path, options: e57_pieces(path)),
    Format("glTF", (".glb", ".gltf"), single(read_gltf)),
    Format("VTK", (".vtk",), single(read_vtk)),
    Format("VTK XML", (".vtp", ".vtu"), single(read_vtk_xml)),
    Format("NumPy", (".npy", ".npz"), single(read_npy)),
)


def by_suffix(formats: Iterable[Format]) -> dict[str, Format]:
    """Formats by suffix; of two with the same the later one counts, so that plugins can replace."""
    return {suffix: each for each in formats for suffix in each.suffixes}


def format_of(path: Path, formats: Mapping[str, Format]) -> Format:
    """The format that a file's suffix names.

    Raises
    ------
    InputError
        If it names none; lists the suffixes.
    """
    found = formats.get(path.suffix.lower())
    if found is None:
        suffix = repr(path.suffix) if path.suffix else "no suffix"
        raise InputError(f"{path}: expected a file ending in {', '.join(formats)}; got {suffix}")
    return found
