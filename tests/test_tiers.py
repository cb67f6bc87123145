"""The tiers: what belongs where, and that nothing is left out in silence."""

import subprocess
import sys

import pytest

from tests import tiers


@pytest.mark.parametrize(
    ("path", "slow", "tier"),
    [
        ("tests/kernels/test_kernels.py", False, "check"),
        ("tests/integration/test_golden.py", False, "test"),
        ("tests/new/test_new.py", False, "test"),
        ("tests/kernels/test_kernels.py", True, "all"),
        ("tests/documents/test_docs.py", False, "all"),
    ],
)
def test_a_file_belongs_to_a_tier(path: str, slow: bool, tier: str) -> None:
    assert tiers.tier_of(path, slow) == tier


def test_each_tier_holds_the_ones_before() -> None:
    for number, asked in enumerate(tiers.TIERS):
        assert [tiers.runs(tier, asked) for tier in tiers.TIERS] == [
            k <= number for k in range(len(tiers.TIERS))
        ]


def test_every_start_of_a_path_exists(pytestconfig: pytest.Config) -> None:
    for start, tier in tiers.TIER_OF:
        assert (pytestconfig.rootpath / start).exists(), start
        assert tier in tiers.TIERS


@pytest.mark.parametrize("workers", [[], ["-n", "2"]])
def test_what_is_left_out_is_said(pytestconfig: pytest.Config, workers: list[str]) -> None:
    files = ["tests/documents/test_docs.py", "tests/types/test_lazy.py"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--tier", "check", *workers, *files],
        cwd=pytestconfig.rootpath, capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "left to --tier test and all" in done.stdout
    assert "tests/documents/test_docs.py" in done.stdout
