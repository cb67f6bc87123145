"""The spreads that stages declare are those that are measured."""

import numpy as np
import pytest

from experiments.calibration import descriptor_spread
from mvreg.types.view import typical_distance


@pytest.mark.parametrize("stage", ["spectrum", "eigenvalues"])
def test_what_is_declared_is_about_what_is_measured(stage):
    features = descriptor_spread.described("tiny", stage)
    found = np.median([typical_distance(view.descriptors) for view in features])
    assert features[0].declared_spread == pytest.approx(found, rel=0.25)


def test_the_table_has_a_line_per_stage_that_describes(capsys):
    descriptor_spread.main(["tiny"])
    printed = capsys.readouterr().out
    assert "spectrum" in printed and "eigenvalues" in printed
    assert "none" not in printed.lower().replace("none │\n", "")
