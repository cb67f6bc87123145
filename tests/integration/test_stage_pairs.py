"""Every two stages of different kinds in the default method: they fit each other, too.

All pairs take minutes and are run by ``--tier all`` alone; always run are so many that every stage
meets one of another kind that it does not meet in the default method.
"""

import pytest
from stage_matrix import EXCEPTIONS, STAGES, covering, default, is_complete, pairs, registered

PAIRS = pairs()
SOME = covering(PAIRS)

#: Pairs with which scans are left over though neither stage is an exception by itself, and why.
ONCE = (
    "registers every scan to the model once, in the order given, and does not try again what the "
    "judge refuses"
)
PAIR_EXCEPTIONS: dict[tuple[str, str], str] = {
    ("downsample/stride", "strategy/sequential"): ONCE,
    ("downsample/voxel", "strategy/sequential"): ONCE,
    ("describe/eigenvalues", "strategy/sequential"): ONCE,
}


def check(pair: tuple[str, str]) -> None:
    """No scan is placed wrongly, and none is left over but for the reasons given."""
    result = registered(*pair)
    if result is None or set(pair) & set(EXCEPTIONS):
        return
    assert is_complete(result) == (pair not in PAIR_EXCEPTIONS)


@pytest.mark.parametrize("pair", SOME, ids=" ".join)
def test_some_pairs_fit(pair: tuple[str, str]) -> None:
    check(pair)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [pair for pair in PAIRS if pair not in SOME], ids=" ".join)
def test_all_pairs_fit(pair: tuple[str, str]) -> None:
    """An exception that places all scans after all fails: it is to be removed."""
    check(pair)


def test_every_stage_meets_another() -> None:
    assert {key for pair in SOME for key in pair} == set(STAGES) - default()


def test_every_exception_is_a_pair_with_a_reason() -> None:
    assert set(PAIR_EXCEPTIONS) <= set(PAIRS)
    assert all(PAIR_EXCEPTIONS.values())
    assert not any(set(pair) & set(EXCEPTIONS) for pair in PAIR_EXCEPTIONS)
