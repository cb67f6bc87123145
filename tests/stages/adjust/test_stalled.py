"""Rounds of joint refinement end where contacts come and go."""

import pytest

from mvreg.stages.adjust.joint.convergence import stalled


@pytest.mark.parametrize(
    ("moves", "ends"),
    [
        ([], False), ([3.0, 3.0], False), ([8.0, 1.0, 0.1], False), ([1.0, 0.9, 0.8], True),
        ([1.0, 0.2, 0.51], True), ([1.0, 0.2, 0.49], False), ([9.0, 1.0, 0.2, 0.9], True),
    ],
)  # fmt: skip
def test_moves_that_hardly_shrink_in_two_rounds_end_a_phase(moves, ends):
    assert stalled(moves) is ends
