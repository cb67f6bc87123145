"""Numbers as people read them."""

import pytest

from mvreg.types.figures import significant


@pytest.mark.parametrize(
    ("value", "digits", "said"),
    [
        (7411.2, 3, "7,410"), (1234567.0, 3, "1,230,000"), (0.012345, 3, "0.0123"),
        (12.0, 4, "12"), (0.0, 3, "0"), (1e-7, 3, "0.0000001"), (float("inf"), 3, "Infinity"),
    ],
)  # fmt: skip
def test_significant_digits_without_an_exponent(value, digits, said):
    assert significant(value, digits) == said
