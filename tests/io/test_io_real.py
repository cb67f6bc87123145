"""Every real scan at hand is read whole."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.io import read_points


def test_every_real_scan_is_read_whole(data_root: Path) -> None:
    files = sorted(data_root.rglob("*.ply"))
    assert files
    for file in files:
        announced = re.search(rb"element vertex (\d+)", file.read_bytes()[:2000])
        assert announced is not None
        points = read_points(file)
        assert points.shape == (int(announced[1]), 3), file
        assert 0.01 < np.ptp(points, axis=0).max() < 0.5, f"{file}: metres"


def test_stray_words_in_the_header_change_nothing(data_root: Path) -> None:
    odd = read_points(data_root / "odd" / "dragonStandRight_24_stray_header_lines.ply")
    original = read_points(data_root / "dragon_stand" / "dragonStandRight_24.ply")
    np.testing.assert_array_equal(odd, original)


def test_numbers_are_exact(data_root: Path) -> None:
    file = data_root / "bunny" / "data" / "bun000.ply"
    body = file.read_text().split("end_header\n")[1].split("\n")[:500]
    expected = [[float(word) for word in line.split()] for line in body]
    np.testing.assert_array_equal(read_points(file)[:500], expected)


@pytest.mark.parametrize("name", ["bunny/data/chin.ply", "armadillo_partial/ArmadilloBack_30.ply"])
def test_a_truncated_real_scan_is_refused(data_root: Path, tmp_path: Path, name: str) -> None:
    whole = (data_root / name).read_bytes()
    for share in (0.001, 0.1, 0.3):
        cut = tmp_path / "cut.ply"
        cut.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"the file ends|only .* bytes follow"):
            read_points(cut)
