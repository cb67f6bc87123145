"""The scans of a set are read side by side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from threading import Barrier
from typing import TypeVar

import numpy as np
import pytest

import mvreg.datasets.folder_scans
import mvreg.datasets.stanford
from mvreg import parallel
from mvreg.datasets.folder import Folder
from mvreg.datasets.stanford import Stanford
from mvreg.errors import InputError
from mvreg.io import iterate_clouds, read_points

T = TypeVar("T")


@pytest.fixture
def points(rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {f"{i}.xyz": rng.normal(size=(10 + i, 3)) for i in range(6)}


@pytest.fixture
def folder(tmp_path: Path, points: dict[str, np.ndarray]) -> Path:
    for name, each in points.items():
        np.savetxt(tmp_path / name, each, fmt="%.17g")
    identity = "0 0 0 0 0 0 1"
    (tmp_path / "a.conf").write_text("".join(f"bmesh {i}.xyz {identity}\n" for i in (4, 1, 0, 5)))
    return tmp_path


def stanford(folder: Path, names: list[str]) -> Stanford:
    return Stanford(
        name="a", conf="a.conf", files=names, url="x", root=str(folder), unit_per_metre=1
    )


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_scans_come_in_order_whatever_the_number_of_threads(
    folder: Path, points: dict[str, np.ndarray], rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch, threads: int,
) -> None:  # fmt: skip
    monkeypatch.setattr(parallel, "threads", lambda: threads)
    for source, names in (
        (Folder(path=str(folder)), sorted(points)),
        (stanford(folder, sorted(points)), [f"{i}.xyz" for i in (4, 1, 0, 5, 2, 3)]),
    ):
        scans = source(rng).scans
        assert [scan.name for scan in scans] == names
        for scan in scans:
            np.testing.assert_array_equal(scan.points, points[scan.name])


def test_two_files_are_read_at_once(
    folder: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parallel, "threads", lambda: 2)
    both = Barrier(2)

    def waiting(read: Callable[..., T]) -> Callable[..., T]:
        def both_read(*arguments: object) -> T:
            both.wait(timeout=20)  # an error unless there are two here
            return read(*arguments)

        return both_read

    monkeypatch.setattr(mvreg.datasets.folder_scans, "iterate_clouds", waiting(iterate_clouds))
    monkeypatch.setattr(mvreg.datasets.stanford, "read_points", waiting(read_points))
    assert len(Folder(path=str(folder))(rng).scans) == 6
    assert len(stanford(folder, ["0.xyz", "1.xyz"])(rng).scans) == 2


def test_the_first_file_in_order_that_is_damaged_is_named(
    folder: Path, points: dict[str, np.ndarray], rng: np.random.Generator
) -> None:
    for name in ("4.xyz", "2.xyz", "5.xyz"):
        (folder / name).write_text("1 2 3\n4 x 6\n")
    with pytest.raises(InputError, match=r"4\.xyz, line 2"):
        stanford(folder, sorted(points))(rng)
    with pytest.raises(InputError, match=r"3 of 6 files .*\n.*2\.xyz.*\n.*4\.xyz.*\n.*5\.xyz"):
        Folder(path=str(folder))(rng)
