"""Numbers from text: bit for bit Python's own, and nothing taken that `float` refuses."""

from __future__ import annotations

import sys
from threading import Event, Thread

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mvreg.kernels.text import parse_rows
from mvreg.testing.reference import text as reference

ODD = ["nan", "-NaN", "inf", "-Infinity", "+INF", "-0", "-0.0", "0e999", "1.", "-.5", "+7", "1e400",
       "5e-324", "2.4703282292062327e-324", "2.2250738585072011e-308", "1.7976931348623159e308",
       "1e00005", "1e-9999999", "1e99999999999999999999", "0.3e-22", "9007199254740993",
       "18446744073709551617", ".18446744073709551617", "1e18446744073709551617",  # beyond 64 bits
       "0" * 30 + "1", "." + "0" * 30 + "7", "1" + "0" * 400, "0." + "3" * 400]  # fmt: skip
floats = st.floats()
words = st.one_of(
    floats.map(repr),
    st.builds("{:.{}e}".format, floats, st.integers(0, 25)),
    st.builds("{:.{}g}".format, floats, st.integers(1, 19)),
    st.builds("{:.{}f}".format, st.floats(-1e6, 1e6), st.integers(0, 25)),
    st.builds("{}e{}".format, st.integers(2**53 - 2, 2**53 + 2), st.integers(-24, 24)),
    st.from_regex(r"[+-]?([0-9]{1,25}\.?|[0-9]{0,21}\.[0-9]{1,21})([eE][+-]?[0-9]{1,5})?",
                  fullmatch=True),
    st.sampled_from(ODD),
)  # fmt: skip


def bits(table: np.ndarray) -> list[int]:
    return table.view(np.uint64).ravel().tolist()


@settings(max_examples=1000, deadline=None)
@given(words)
def test_a_number_is_what_float_makes_of_it(word: str) -> None:
    parsed = parse_rows(f"{word} 1".encode(), 0, 1, 2)
    assert parsed is not None
    assert bits(parsed[0]) == bits(np.array([float(word), 1.0]))


@pytest.mark.parametrize("word", ODD)
def test_odd_numbers_are_what_float_makes_of_them(word: str) -> None:
    parsed = parse_rows(word.encode(), 0, 1, 1)
    assert parsed is not None
    assert bits(parsed[0]) == bits(np.array([float(word)]))


def test_many_numbers_are_exact(rng: np.random.Generator) -> None:
    values = rng.integers(0, 2**64, 30_000, dtype=np.uint64).view(np.float64)
    scans = rng.normal(size=30_000)
    many = [
        *map(repr, values.tolist()),
        *(f"{x:.7g}" for x in scans),
        *(f"{x:.15g}" for x in scans),
    ]
    parsed = parse_rows(" ".join(many).encode(), 0, 1, len(many))
    assert parsed is not None
    assert bits(parsed[0]) == bits(np.array([float(word) for word in many]))


#: What comes near to a number, and what may part numbers.
pieces = st.sampled_from(
    [*"0123456789.eE+-_#x, \t\r\v\f\n\0\xa0\x1c", " ", "\n", "nan", "1.5", "2 ", "3 4\n"]
)


@settings(max_examples=1000, deadline=None)
@given(st.lists(pieces, max_size=12), st.integers(0, 4), st.integers(-1, 4), st.integers(-1, 3))
@example(["1 2\n", "3 4 5 6\n"], 0, 2, 3)
@example(["1 2\n", "3\n", "4 5\n"], 0, 2, 2)
@example(["1 2 \0"], 0, 1, 2)
@example(["\v1\t2\f3\r4 \v\n"], 0, 1, 4)
def test_any_text_is_taken_or_refused_as_by_the_reference(
    text: list[str], start: int, rows: int, columns: int
) -> None:
    data = "".join(text).encode("latin-1")
    start = min(start, len(data))
    expected = reference.parse_rows(data, start, rows, columns)
    found = parse_rows(data, start, rows, columns)
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        assert found[0].shape == (rows, columns)
        assert bits(found[0]) == bits(expected[0])
        assert found[1] == expected[1]


@pytest.mark.parametrize("newline", [b"\n", b" \r\n", b"\n\n"])
def test_cut_anywhere_it_is_as_the_reference_says(newline: bytes) -> None:
    whole = b"x\n" + newline.join([b"1.5 -2e3 nan", b"4 5 6", b"7 8 9", b""])
    for end in range(2, len(whole) + 1):
        expected = reference.parse_rows(whole[:end], 2, 3, 3)
        found = parse_rows(whole[:end], 2, 3, 3)
        assert (found is None) == (expected is None), whole[:end]
        if found is not None:
            assert bits(found[0]) == bits(expected[0])
            assert found[1] == expected[1]
    assert (found is None) == (newline == b"\n\n")


def test_odd_words_and_flaws_are_found_in_any_row() -> None:
    rows = [b"%d 0.25" % row for row in range(5000)]
    rows[1500:1700] = [b"nan 123456789012345678901234567890"] * 200
    rows[3500] = b"-inf 0.1"
    expected = np.array([[float(word) for word in row.split()] for row in rows])
    found = parse_rows(b"\n".join(rows), 0, 5000, 2)
    assert found is not None
    np.testing.assert_array_equal(found[0], expected)
    for bad in (0, 1600, 2600, 4999):
        assert parse_rows(b"\n".join([*rows[:bad], b"1 x", *rows[bad + 1 :]]), 0, 5000, 2) is None


@pytest.mark.parametrize(
    ("start", "rows", "columns"),
    [(0, 10**15, 3), (0, 1, 2**62), (0, 2**62, 2**62), (7, 1, 3), (-1, 1, 3), (0, 0, 3), (0, 1, 0)],
)
def test_made_up_sizes_ask_for_no_memory(start: int, rows: int, columns: int) -> None:
    assert parse_rows(b"1 2 3\n", start, rows, columns) is None


def test_the_lock_is_released_meanwhile() -> None:
    data, finished, started = b"1 " * 5_000_000, Event(), Event()

    def work() -> None:
        started.set()
        parse_rows(data, 0, 1, 5_000_000)
        finished.set()

    before = sys.getswitchinterval()
    sys.setswitchinterval(60)  # nobody takes the lock: who does not let go, is through before this
    try:
        for _ in range(20):
            finished.clear()
            started.clear()
            thread = Thread(target=work)
            thread.start()
            started.wait()
            alone = finished.is_set()
            thread.join()
            if not alone:
                return
    finally:
        sys.setswitchinterval(before)
    pytest.fail("no other thread ran while a table was parsed")
