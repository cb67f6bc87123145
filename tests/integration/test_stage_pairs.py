"""Every two stages of different kinds in the default method: they fit each other, too.

All pairs take minutes and are run by ``--tier all`` alone; always run are so many that every stage
meets one of another kind that it does not meet in the default method.
"""

import pytest
from stage_matrix import EXCEPTIONS, STAGES, covering, default, is_complete, pairs, registered

PAIRS = pairs()
SOME = covering(PAIRS)

#: Stages with which it depends on the other one whether scans are left over, and why.
DEPENDS = {
    "strategy/sequential": "registers every scan to the model once, in the order given, and does "
    "not try again what the judge refuses",
}


def check(pair: tuple[str, str]) -> None:
    """No scan is placed wrongly, and none is left over but for the reasons given."""
    result = registered(*pair)
    if result is not None and not set(pair) & {*EXCEPTIONS, *DEPENDS}:
        assert is_complete(result)


@pytest.mark.parametrize("pair", SOME, ids=" ".join)
def test_some_pairs_fit(pair: tuple[str, str]) -> None:
    check(pair)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [pair for pair in PAIRS if pair not in SOME], ids=" ".join)
def test_all_pairs_fit(pair: tuple[str, str]) -> None:
    check(pair)


def test_every_stage_meets_another() -> None:
    assert {key for pair in SOME for key in pair} == set(STAGES) - default()


def test_what_depends_on_the_other_stage_is_complete_with_some() -> None:
    assert all(is_complete(registered(key)) and reason for key, reason in DEPENDS.items())
