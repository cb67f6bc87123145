from dataclasses import replace

import numpy as np
import pytest
from mvreg_fpfh import FpfhDescribe, mvreg_suites

import mvreg
from mvreg.plugins.manager import stages


class TestFpfhDescribe(mvreg_suites()["describe/fpfh"]):
    """The contract, but that rounding may change a bin in a hundred."""


def test_it_is_installed_under_its_name():
    found = stages()["describe/fpfh"]
    assert (found.cls, found.plugin) == (FpfhDescribe, "fpfh")
    assert found.origin.startswith("mvreg-fpfh ")


def test_histograms_add_up_and_lonely_keypoints_are_left_out():
    suite = TestFpfhDescribe()
    scan, (keypoints, spacing) = suite.scan(), suite.keypoints()
    lonely = np.array([[1e3, 0, 0]])
    found = FpfhDescribe()(scan, np.concatenate([lonely, keypoints]), spacing)
    assert len(found.keypoints) == len(keypoints)
    histograms = found.descriptors.reshape(-1, 3, 11)
    np.testing.assert_allclose(histograms.sum(axis=2), 1, atol=1e-6)


@pytest.mark.parametrize("wrong", [{"radius": 0}, {"stride": 0}, {"radius": float("nan")}])
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(mvreg.InputError, match=r"describe: expected radius > 0 and stride > 0"):
        replace(FpfhDescribe(), **wrong)
