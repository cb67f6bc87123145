import pytest

from mvreg.report.formatting import confidence, count, length, number, unit


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "-"), (0.0, "0.00"), (0.5, "0.50"), (0.994, "0.99"), (0.996, ">0.99"), (1.0, ">0.99")],
)
def test_a_confidence_is_never_shown_as_certainty(value, shown):
    assert confidence(value) == shown


def test_lengths_have_digits_by_their_unit():
    assert length(12.34567, {"unit": "mm"}) == "12.346"
    assert length(0.001234567, {"unit": "m"}) == length(0.001234567, {}) == "0.001235"
    assert length(None, {}) == number(None, ".2f") == "-"
    assert [unit({"unit": "mm"}), unit({"unit": "file"}), unit({})] == ["mm", *["file units"] * 2]


def test_things_are_counted_in_words():
    assert [count(n, "scan") for n in (0, 1, 2)] == ["0 scans", "1 scan", "2 scans"]
