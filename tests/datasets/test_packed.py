"""Packed scans in a folder: read where they are not there unpacked, too."""

from __future__ import annotations

import gzip
import zipfile

import numpy as np
import pytest

import mvreg
from mvreg.datasets.folder import Folder
from mvreg.io import write_ply


@pytest.fixture
def scans(tmp_path):
    made = {scan.name: scan.points for scan in mvreg.dataset("tiny", views=3).scans}
    for name, points in made.items():
        write_ply(tmp_path / f"{name}.ply", points)
    return tmp_path


def names(folder):
    found = Folder(path=str(folder))(np.random.default_rng(0))
    return [scan.name for scan in found.scans], found


def pack(folder, archive):
    with zipfile.ZipFile(archive, "w") as packed:
        for file in sorted(folder.glob("*.ply")):
            packed.write(file, file.name)


def test_that_archives_alone_are_read(scans, tmp_path_factory):
    folder = tmp_path_factory.mktemp("packed")
    pack(scans, folder / "all.zip")
    read, found = names(folder)
    assert read == [f"all.zip:tiny_0{k}.ply" for k in range(3)]
    first = next(scan for scan in found.scans if scan.name.endswith("tiny_00.ply"))
    np.testing.assert_array_equal(first.points, mvreg.dataset("tiny", views=3).scans[0].points)


def test_that_an_archive_beside_scans_is_left_out_and_named(scans):
    pack(scans, scans / "all.zip")
    (scans / "backup.tar.gz").write_bytes(gzip.compress(b"anything"))
    read, found = names(scans)
    assert read == [f"tiny_0{k}.ply" for k in range(3)]
    said = " ".join(found.remarks)
    assert "packed files beside others left out: all.zip" in said
    assert "1 file was left out, of a kind that cannot be read: .gz" in said
    assert found.input.left_out["all.zip"] == "packed, beside files that are not"


def test_that_compressed_scans_are_read_once(scans):
    for file in sorted(scans.glob("*.ply")):
        (scans / f"{file.name}.gz").write_bytes(gzip.compress(file.read_bytes()))
    (scans / "tiny_00.ply").unlink()
    read, found = names(scans)
    assert read == ["tiny_00.ply.gz", "tiny_01.ply", "tiny_02.ply"]
    assert "left out: tiny_01.ply.gz, tiny_02.ply.gz" in " ".join(found.remarks)
