"""Large scans take memory for what is held of them."""

from __future__ import annotations

import tracemalloc

import numpy as np

from mvreg.io import PointCloud
from mvreg.io.las_write import write_las_clouds
from mvreg.report.run_folder import write_model
from tests.support.large_folders import RNG, folder, write


def peak(path, name, count):
    """Bytes that it takes to read a folder with a scan of so many points, and write its model."""
    write(path / "b.ply", 2000)
    tracemalloc.start()
    scans = folder(path, 20_000)
    write_model(path / "out/model.ply", scans, {name: np.eye(4)})
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert scans.scans[0].full.count == count
    return found


def test_that_a_part_of_a_compressed_scan_takes_a_part_of_its_memory(tmp_path, monkeypatch):
    """LAZ is not counted by tracemalloc where lazrs works, but all that we make of it is."""
    monkeypatch.setattr("mvreg.io.las.CHUNK", 10_000)
    peaks = []
    for count in (200_000, 400_000):
        points = RNG.normal(size=(count, 3))
        write_las_clouds(tmp_path / "a.laz", [PointCloud(points)], {})
        peaks.append(peak(tmp_path, "a.laz", count))
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 24 * 400_000


def test_that_a_part_of_a_file_takes_a_part_of_its_memory(tmp_path, monkeypatch):
    """However large the file is: twice the points take no more."""
    monkeypatch.setattr("mvreg.io.pieces.ROWS", 10_000)
    peaks = []
    for count in (400_000, 800_000):
        write(tmp_path / "a.ply", count)
        peaks.append(peak(tmp_path, "a.ply", count))
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < (tmp_path / "a.ply").stat().st_size / 4
