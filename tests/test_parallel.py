"""Work in threads: answers in order, none twice, and nested calls stay in their thread."""

import sys
from threading import Barrier, get_ident
from time import sleep

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mvreg import parallel
from mvreg.parallel import in_threads, one_by_one, quick_turns, slices, spare


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


def test_the_callers_thread_works_too():
    together = Barrier(3, timeout=30)  # passed only if three threads are at it at once

    def ident(_):
        together.wait()
        return get_ident()

    found = set(in_threads(ident, range(3)))
    assert get_ident() in found
    assert len(found) == 3


def test_a_core_is_spare_as_long_as_one_thread_works_alone(monkeypatch):
    assert spare()
    assert in_threads(lambda _: spare(), range(10)) == [False] * 10
    assert spare()
    monkeypatch.setattr(parallel, "threads", lambda: 1)
    assert not spare()


def test_what_goes_wrong_in_a_thread_is_raised():
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda k: 1 / k, [1, 0, 2])
    assert in_threads(abs, range(5)) == list(range(5))  # and all goes on as before


def test_the_first_of_what_goes_wrong_is_raised():
    together = Barrier(3, timeout=30)

    def fail(k):
        together.wait()
        raise ValueError(k)

    with pytest.raises(ValueError, match=r"^0$"):
        in_threads(fail, range(3))


def test_nothing_more_is_begun_once_the_caller_is_interrupted():
    begun = []
    caller = get_ident()

    def interrupted(k):
        begun.append(k)
        if get_ident() == caller:
            raise KeyboardInterrupt
        sleep(1e-3)

    with pytest.raises(KeyboardInterrupt):
        in_threads(interrupted, range(100_000))
    assert len(begun) < 100_000
    assert in_threads(abs, range(5)) == list(range(5))


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
