"""What looks wrong with scans before any registration."""

from __future__ import annotations

import numpy as np
import pytest

import mvreg
from mvreg.datasets.inspection import inspect_scans
from mvreg.geometry import se3
from mvreg.types import Finding, Scan

SCANS = mvreg.dataset("tiny", scramble=True, rng=3).scans


def found(points: list[np.ndarray]) -> tuple[Finding, ...]:
    return inspect_scans([Scan(f"{i}.ply", each) for i, each in enumerate(points)])


def plain() -> list[np.ndarray]:
    return [scan.points for scan in SCANS]


@pytest.mark.parametrize("name", ["tiny", "figurine", "room", "street", "desk", "office"])
def test_good_scans_look_good(name: str) -> None:
    assert inspect_scans(mvreg.dataset(name).scans) == ()


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1000, "1,000 times smaller, as metres beside millimetres"),
        (25.4, "25.4 times smaller, as inches beside millimetres"),
        (304.8, "304.8 times smaller, as feet beside millimetres"),
        (10, "10 times smaller, as centimetres beside millimetres"),
        (0.01, "100 times larger, as centimetres beside metres"),
    ],
)
@pytest.mark.parametrize("which", [slice(1, 2), slice(1, None, 2)])
def test_another_unit(factor: float, said: str, which: slice) -> None:
    scans = plain()
    changed = range(len(scans))[which]
    for index in changed:
        scans[index] = scans[index] / factor
    (finding,) = found(scans)
    assert finding.kind == "unit"
    if len(changed) == 1 or factor > 1:
        assert finding.scans == tuple(f"{index}.ply" for index in changed)
        assert f"another unit? ({said})" in finding.text
        assert "the median scan 1" in finding.text or factor < 1
    assert "unit of length" in finding.advice


def test_an_unusual_factor_is_no_known_unit() -> None:
    (finding,) = found([*plain()[:4], plain()[4] * 3000])
    assert finding.text.endswith("another unit?")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p, rng: p.copy(), "1.ply has the points of 0.ply"),
        (lambda p, rng: se3.apply(se3.random(rng, 9.0), p), "the points of 0.ply, moved"),
        (lambda p, rng: rng.permutation(p) + 5, "the points of 0.ply, moved"),
        (lambda p, rng: p * 1.05, "the points of 0.ply, 1.05 times as large"),
        (lambda p, rng: p * [-1, 1, 1], "the points of 0.ply, mirrored"),
        (lambda p, rng: p.astype(np.float32) + 0.5, "the points of 0.ply, moved"),
    ],
)  # fmt: skip
def test_copies(change, said: str, rng: np.random.Generator) -> None:  # type: ignore[no-untyped-def]
    (finding,) = found([plain()[0], change(plain()[0], rng), plain()[1]])
    assert (finding.kind, finding.scans) == ("copy", ("1.ply", "0.ply"))
    assert finding.text.endswith(said)


def test_scans_of_the_same_size_are_no_copies(rng: np.random.Generator) -> None:
    assert found([points[:5000] for points in plain()]) == ()
    assert found([rng.normal(size=(50, 3)) for _ in range(4)]) == ()
    assert found([np.ones((20, 3)) * index for index in range(3)]) == ()


UTM = np.array([451234.5, 5412345.25, 312])


def test_single_precision_of_large_coordinates() -> None:
    (finding,) = found([(p / 100 + UTM).astype(np.float32) for p in plain()])
    assert finding.kind == "steps" and len(finding.scans) == 6
    assert "are steps of 0.5 (single precision at 5,412,34" in finding.text
    assert "double precision" in finding.advice
    assert found([p / 100 + UTM for p in plain()]) == ()
    assert found([p.astype(np.float32) for p in plain()]) == ()


def test_coordinates_of_few_digits() -> None:
    (finding,) = found([np.round(p / 10) * 10 for p in plain()])
    assert "are steps of 10, as coarse as the scan itself" in finding.text
    (finding,) = found([np.round(p, -1) / 1e3 + 12345.67 for p in plain()])
    assert "are steps of 0.01, as" in finding.text
    assert found([np.round(p, 1) for p in plain()]) == ()


def test_an_image_of_ranges_has_steps_in_two_axes_only() -> None:
    x, y = np.meshgrid(np.arange(60.0), np.arange(80.0))
    assert (
        found([np.stack([x, y, np.sin(x / 9 + k) * y], -1).reshape(-1, 3) for k in range(3)]) == ()
    )


def test_points_far_from_all_others() -> None:
    scans = plain()
    scans[2] = np.vstack([scans[2], [[1e6, 0, 0]] * 3])
    (finding,) = found(scans)
    assert (finding.kind, finding.scans) == ("stray", ("2.ply",))
    assert finding.text.startswith("2.ply: 3 points are up to 1,000,000 from the middle")
