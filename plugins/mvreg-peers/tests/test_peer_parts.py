"""Clouds, the spanning tree, and oneTBB held at one thread."""

import os
from ctypes.util import find_library
from pathlib import Path

import numpy as np
import pytest
from mvreg_peers.clouds import clouds_of, in_scan_frames
from mvreg_peers.graph import Attempt, spanning_tree

import mvreg
from mvreg.geometry import se3
from mvreg.geometry.nearest import mean_spacing
from mvreg.tbb import copies_of_tbb, one_thread, threads_allowed
from mvreg.testing import blob_views
from mvreg.testing.compare import apart
from mvreg.testing.views import degenerate_views
from mvreg.types import Verdict


def edge(source, target, quality, poses, reliable=True):
    pose = se3.invert(poses[target]) @ poses[source]
    return Attempt(source, target, Verdict(reliable, 0, 0, ""), None, pose, quality)


def test_the_tree_takes_the_best_way_and_leaves_out_what_is_not_joined():
    rng = np.random.default_rng(2)
    poses = [np.eye(4), *(se3.random(rng, 5.0) for _ in range(5))]
    wrong = [np.eye(4), *(se3.random(rng, 5.0) for _ in range(5))]
    edges = [
        edge(1, 0, 0.4, poses), edge(2, 0, 0.9, poses), edge(2, 1, 0.6, poses),
        edge(3, 1, 0.5, poses), edge(3, 0, 0.3, wrong),
        edge(4, 0, 0.95, wrong, reliable=False), edge(5, 4, 0.9, poses),
    ]  # fmt: skip
    found = spanning_tree(edges, 0)
    assert list(found) == [0, 2, 1, 3]
    for index, pose in found.items():
        np.testing.assert_allclose(pose, poses[index], atol=1e-12)


def test_the_worse_of_two_ways_does_not_count():
    rng = np.random.default_rng(3)
    good, bad = ([np.eye(4), *(se3.random(rng, 5.0) for _ in range(2))] for _ in range(2))
    edges = [edge(1, 0, 0.4, bad), edge(2, 0, 0.9, good), edge(2, 1, 0.6, good)]
    np.testing.assert_allclose(spanning_tree(edges, 0)[1], good[1], atol=1e-12)


def test_clouds_are_raw_scans_about_their_mean_in_resolutions():
    views = blob_views(3)
    clouds = clouds_of(views)
    for view, cloud in zip(views, clouds, strict=True):
        assert len(cloud.points) == len(view.scan.points) > len(view.points)
        np.testing.assert_allclose(cloud.points.mean(axis=0), 0, atol=1e-9)
        np.testing.assert_allclose(cloud.points * cloud.unit + cloud.centre, view.scan.points)
    assert np.median([mean_spacing(cloud.points) for cloud in clouds]) == pytest.approx(1)


def test_a_view_without_a_scan_gives_its_points_and_one_point_gives_none():
    poor = degenerate_views()
    planar = poor["planar"]
    assert planar.scan is None
    (cloud,) = clouds_of([planar])
    np.testing.assert_allclose(cloud.points * cloud.unit + cloud.centre, planar.points, atol=1e-9)
    assert [len(cloud.points) for cloud in clouds_of([poor["one point"]] * 2)] == [0, 0]


def test_a_pose_of_clouds_is_a_pose_of_scans():
    views = blob_views(2)
    source, target = clouds_of(views)
    pose = se3.random(np.random.default_rng(1), 10.0)
    points = views[0].scan.points
    expected = se3.apply(pose, source.points) * target.unit + target.centre
    found = se3.apply(in_scan_frames(pose, source, target), points)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    back = in_scan_frames(se3.invert(pose), target, source)
    assert apart(back @ in_scan_frames(pose, source, target), np.eye(4), points) < 1e-9


@pytest.mark.parametrize("name", ["open3d", "kiss_matcher"])
def test_one_thread_inside_and_all_of_them_again_after(name):
    mvreg.load_open3d()
    module = pytest.importorskip(name, reason="needs pip install 'mvreg-peers[kiss]'")
    (library,) = copies_of_tbb(module)
    before = threads_allowed(library)
    with one_thread(library):
        assert threads_allowed(library) == 1
        with one_thread(library):
            assert threads_allowed(library) == 1
        assert threads_allowed(library) == 1
    assert threads_allowed(library) == before
    assert before > 1 or os.cpu_count() == 1


def test_a_library_that_is_not_onetbb_is_left_alone():
    library = find_library("c")
    if library is None:
        pytest.skip("needs a C library that can be found by name")
    with one_thread(Path(library)) as nothing:
        assert nothing is None
