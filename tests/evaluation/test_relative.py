"""How certain one scan is relative to another, asked of a result."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.report.rows import link_rows
from mvreg.report.summary import totals
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.types import Result


@pytest.fixture(scope="module")
def result():
    """Five views of a blob, refined from the truth."""
    truth, views = blob_scans(5).poses, tuple(blob_views(5))
    base = se3.invert(truth[views[0].name])
    start = Result(views[0].name, {v.name: base @ truth[v.name] for v in views}, (), ())
    return replace(JointRefinement()(start, views, pipeline()), views=views)


def test_of_linked_scans_it_is_that_of_the_link(result):
    assert len(result.links) > 8
    for link in result.links:
        found = mvreg.relative_covariance(result, link.source, link.target)
        np.testing.assert_allclose(found, link.covariance, rtol=1e-6, atol=1e-18)
        np.testing.assert_allclose(found, found.T)
        assert np.linalg.eigvalsh(found).min() > 0


def test_relative_to_the_reference_it_is_that_of_the_scan(result):
    for name in set(result.poses) - {result.reference}:
        found = mvreg.relative_covariance(result, name, result.reference)
        np.testing.assert_allclose(found, result.covariances[name], rtol=1e-6, atol=1e-18)


def test_the_other_way_round_it_is_the_same_motion_seen_from_the_other_scan(result):
    one, other = list(result.poses)[1:3]
    there = mvreg.relative_covariance(result, one, other)
    back = mvreg.relative_covariance(result, other, one)
    change = se3.adjoint(se3.invert(result.poses[other]) @ result.poses[one])
    np.testing.assert_allclose(there, change @ back @ change.T, rtol=1e-6, atol=1e-18)


def test_links_tell_it_the_other_way_round_too(result):
    for link in result.links:
        pose = se3.invert(result.poses[link.target]) @ result.poses[link.source]
        back = mvreg.relative_covariance(result, link.target, link.source)
        np.testing.assert_allclose(link.covariance_back(pose), back, rtol=1e-6, atol=1e-18)
        assert replace(link, covariance=None).covariance_back(pose) is None


def test_the_report_has_it_where_only_the_other_way_has_contacts(result):
    from mvreg.evaluation.assess import assess
    from mvreg.report.rows import link_rows

    rows = link_rows(assess(result, result.views), result, [], 1.0, result.views)
    one_way = tuple(
        link for link in result.links
        if any((row["source"], row["target"]) == (link.target, link.source) for row in rows)
    )  # fmt: skip
    assert one_way
    few = replace(result, links=one_way)
    for row in link_rows(assess(few, few.views), few, [], 1.0, few.views):
        if any({row["source"], row["target"]} == {k.source, k.target} for k in one_way):
            found = mvreg.relative_covariance(result, row["source"], row["target"])
            np.testing.assert_allclose(row["covariance"], found, rtol=1e-6, atol=1e-18)


def test_it_does_not_depend_on_which_scan_is_held(result):
    """But for what is lost of the sums at another gauge."""
    names = list(result.poses)
    base = se3.invert(result.poses[names[3]])
    order = [names[3], *(name for name in names if name != names[3])]
    start = Result(names[3], {name: base @ result.poses[name] for name in order}, (), ())
    other = JointRefinement()(start, result.views, pipeline())
    one = mvreg.relative_covariance(result, names[1], names[2])
    two = mvreg.relative_covariance(other, names[1], names[2])
    assert np.linalg.norm(two - one) < 0.3 * np.linalg.norm(one)


def test_what_is_not_told_is_refused(result):
    names = list(result.poses)
    with pytest.raises(InputError, match=r"'nobody' has no pose; expected one of"):
        mvreg.relative_covariance(result, "nobody", names[0])
    with pytest.raises(InputError, match=r"adjust=joint has joined"):
        mvreg.relative_covariance(replace(result, scatter=()), names[1], names[0])
    poses = dict(result.poses)
    apart = replace(result, poses=poses, components=({names[4]: poses.pop(names[4])},))
    with pytest.raises(InputError, match="different models"):
        mvreg.relative_covariance(apart, names[4], names[0])


def test_the_report_has_it_for_each_link(result):
    found = mvreg.assess(result)
    rows = link_rows(found, result, [], 1.0, result.views)
    assert rows
    for row in rows:
        source, target = str(row["source"]), str(row["target"])
        expected = mvreg.relative_covariance(result, source, target)
        np.testing.assert_allclose(row["covariance"], expected, rtol=1e-6, atol=1e-18)
        turned = np.degrees(np.sqrt(np.trace(expected[:3, :3])))
        assert row["uncertainty"]["angle_deg"] == pytest.approx(turned)
        # A centroid near the middle of the blob: no lever of the turn.
        assert 0 < row["uncertainty"]["translation"] < 1
    lines = [str(line) for line in totals({"links": rows, "unit": "mm"})]
    assert sum("relative poses of linked scans: +-" in line for line in lines) == 1
    bare = replace(result, links=tuple(replace(x, covariance=None) for x in result.links))
    assert {row["covariance"] for row in link_rows(found, bare, [], 1.0, result.views)} == {None}
