"""Pixels without a return at 0, 0, 0 are no points, and how many there were is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.datasets.folder import Folder
from mvreg.errors import InputError

FAR = np.array([0.0, 0.0, 600.0])


def with_zeros(points: np.ndarray, zeros: int, rng: np.random.Generator) -> np.ndarray:
    """Zeros anywhere among the points, of both signs."""
    none = np.zeros((zeros, 3)) * rng.choice([-1.0, 1.0], size=(zeros, 3))
    return np.insert(points, rng.integers(0, len(points) + 1, size=zeros), none, axis=0)


def save(folder: Path, zeros: list[int], rng: np.random.Generator) -> list[np.ndarray]:
    """Scans 0.npy, 1.npy, ... with so many zeros each; returns the points besides."""
    clouds = [rng.normal(size=(50, 3)) + FAR for _ in zeros]
    for index, (cloud, count) in enumerate(zip(clouds, zeros, strict=True)):
        np.save(folder / f"{index}.npy", with_zeros(cloud, count, rng))
    return clouds


def test_zeros_are_dropped_and_counted_once_for_all(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    clouds = save(tmp_path, [2, 0, 1200], rng)
    found = Folder(path=str(tmp_path))(rng)
    for scan, cloud in zip(found.scans, clouds, strict=True):
        np.testing.assert_array_equal(scan.points, cloud)
    (remark,) = found.remarks
    assert remark.startswith("dropped 1,202 points at exactly 0, 0, 0, ")
    assert remark.endswith("from 2 of 3 scans")


def test_a_single_zero_may_be_a_point(tmp_path: Path, rng: np.random.Generator) -> None:
    save(tmp_path, [1, 0], rng)
    np.savetxt(tmp_path / "near.xyz", np.array([[0, 0, 0], [0, 0, 1e-9], [0, 1, 0], [1, 0, 0]]))
    found = Folder(path=str(tmp_path))(rng)
    assert [len(scan.points) for scan in found.scans] == [4, 51, 50]
    assert found.remarks == ()


def test_a_scan_of_nothing_else_is_an_error(tmp_path: Path, rng: np.random.Generator) -> None:
    save(tmp_path, [0, 0], rng)
    np.save(tmp_path / "blind.npy", np.zeros((7, 3)))
    with pytest.raises(InputError, match=r"1 of 3 .*\n.*blind\.npy: expected .* in all 7 points"):
        Folder(path=str(tmp_path))(rng)


def test_a_mixture_keeps_the_remark(tmp_path: Path, rng: np.random.Generator) -> None:
    save(tmp_path, [3, 3], rng)
    plain = mvreg.dataset("folder", path=str(tmp_path))
    mixed = mvreg.dataset("mixture", of=[f"folder path={tmp_path}"])
    assert mixed.remarks == plain.remarks != ()


@pytest.mark.parametrize("share", [0.05, 3.0])
def test_scans_with_zeros_are_placed_as_those_without(tmp_path: Path, share: float) -> None:
    rng = np.random.default_rng(0)
    for scan in mvreg.dataset("tiny", scramble=True, rng=3).scans:
        points = scan.points - scan.points.mean(axis=0) + FAR
        spoilt = with_zeros(points, int(share * len(points)), rng)
        np.save(tmp_path / f"{scan.name}.npy", spoilt.astype("f4"))
    result = mvreg.register(mvreg.dataset("folder", path=str(tmp_path)))
    assert len(result.poses) == 6 and not result.unregistered
