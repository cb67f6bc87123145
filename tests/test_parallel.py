"""Work in threads: answers in order, none twice, and nested calls stay in their thread."""

import sys
from threading import get_ident

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mvreg import parallel
from mvreg.parallel import in_threads, one_by_one, quick_turns, slices


@pytest.fixture(autouse=True)
def three_threads(monkeypatch):
    monkeypatch.setattr(parallel, "threads", lambda: 3)


def test_answers_come_in_the_order_of_the_items():
    assert in_threads(lambda k: k * k, range(200)) == [k * k for k in range(200)]
    assert in_threads(str, []) == []


def test_a_nested_call_stays_in_its_thread():
    def idents(_):
        return {get_ident(), *in_threads(lambda _: get_ident(), range(5))}

    found = in_threads(idents, range(20))
    assert all(len(each) == 1 for each in found)
    assert get_ident() not in set.union(*found)


def test_what_goes_wrong_in_a_thread_is_raised():
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda k: 1 / k, [1, 0, 2])


def test_answers_can_be_had_one_by_one():
    answers = one_by_one(lambda k: -k, [3, 1, 2])
    assert next(answers) == -3
    assert list(answers) == [-1, -2]


@given(st.integers(0, 10_000), st.integers(1, 3000))
def test_slices_cut_all_into_parts_that_are_large_enough(size, least):
    parts = slices(size, least)
    assert [k for part in parts for k in range(size)[part]] == list(range(size))
    assert len(parts) == 1 or min(part.stop - part.start for part in parts) >= least


def test_turns_are_quick():
    before = sys.getswitchinterval()
    try:
        quick_turns()
        assert sys.getswitchinterval() == pytest.approx(parallel.TURN)
    finally:
        sys.setswitchinterval(before)
