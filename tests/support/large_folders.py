"""Folders of scans of which a part is held, and the files that they are made of."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.folder import Folder
from mvreg.io import NotInPiecesError, PointCloud, write_ply_clouds

RNG = np.random.default_rng(3)


def write(path, count):
    points = RNG.normal(size=(count, 3))
    grey = RNG.integers(0, 256, count).astype(np.uint8)
    write_ply_clouds(path, [PointCloud(points, attributes={"grey": grey})], {"grey": grey.dtype})
    return points, grey


def folder(path, most, **more):
    return Folder(path=str(path), most_points=most, **more)(np.random.default_rng(0))


def refuse(*_):
    raise NotInPiecesError


def in_pieces_and_whole(path, monkeypatch):
    """A folder of which files are read in pieces, and the same with all of them read whole."""
    monkeypatch.setattr("mvreg.io.pieces.BYTES", 10_000)
    for name in ("pieces.ROWS", "las.CHUNK", "e57.CHUNK"):
        monkeypatch.setattr(f"mvreg.io.{name}", 700)
    monkeypatch.setattr("mvreg.io.compressed_pieces.WORTH", 0)
    pieces = folder(path, 300)
    monkeypatch.setattr("mvreg.datasets.folder_scans.open_pieces", refuse)
    whole = folder(path, 300)
    assert pieces.remarks == whole.remarks
    return pieces, whole


def text(points, grey):
    return "".join(f"{x} {y} {z} {g}\n" for (x, y, z), g in zip(points.tolist(), grey, strict=True))


def pcd(points, kind):
    return (
        f"VERSION 0.7\nFIELDS x y z grey\nSIZE 8 8 8 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH "
        f"{len(points)}\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS {len(points)}\nDATA {kind}\n"
    )
