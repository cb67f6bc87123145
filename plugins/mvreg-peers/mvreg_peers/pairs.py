"""All pairs, several at a time; observers are told of each, in order."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TypeGuard

import numpy as np

from mvreg import events
from mvreg.contracts import Pipeline
from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.types import Array, Candidates, Matches, Pair, Registration, Result, View
from mvreg_peers.clouds import Cloud, in_scan_frames
from mvreg_peers.graph import Attempt

#: Two registration points closer than this are a pair (resolutions of the target).
PAIRING_DISTANCE = 2.0


def all_pairs(
    views: Sequence[View],
    clouds: Sequence[Cloud],
    pipeline: Pipeline,
    attempt: Callable[[int, int], Attempt],
    threads: int = 0,
) -> tuple[list[Attempt], tuple[Pair, ...]]:
    """Call ``attempt(source, target)`` for all N (N - 1) / 2 pairs, later scans onto earlier ones.

    `attempt` runs in so many threads, 0 for one per core: what it changes it must not share.
    """
    todo = [(source, target) for source in range(len(views)) for target in range(source)]
    edges, pairs = [], []
    pool = ThreadPoolExecutor(threads or os.cpu_count() or 1)
    try:
        running = [pool.submit(attempt, *numbers) for numbers in todo]
        for (source, target), waiting in zip(todo, running, strict=True):
            pipeline.emit(events.PairStarted(views[source], views[target]))
            edge = waiting.result()
            edges.append(edge)
            pairs.append(report(edge, views, clouds, pipeline))
    finally:
        pool.shutdown(cancel_futures=True)
    return edges, tuple(pairs)


def report(
    edge: Attempt, views: Sequence[View], clouds: Sequence[Cloud], pipeline: Pipeline
) -> Pair:
    """Tell observers of a pair, in the words of mvreg."""
    source, target = views[edge.source], views[edge.target]
    ends = clouds[edge.source], clouds[edge.target]
    candidates, registration = Candidates.none(), None
    pair = Pair(source.name, target.name, edge.verdict, seconds=edge.seconds)
    if is_pose(edge.coarse):
        start = in_scan_frames(edge.coarse, *ends)
        score = np.array([edge.verdict.score])
        candidates = Candidates(start[None], score, (Matches.none().indices,))
    if is_pose(edge.pose):
        registration = registered(edge, source, target, in_scan_frames(edge.pose, *ends))
        pair = replace(
            pair,
            T_target_source=registration.T_target_source,
            overlap=registration.overlap,
            trimmed_mse=registration.trimmed_mse,
        )
    pipeline.emit(
        events.PairRegistered(source, target, Matches.none(), candidates, registration, pair)
    )
    return pair


def is_pose(pose: Array | None) -> TypeGuard[Array]:
    """Whether there is one: what cannot be solved may come back as not a number."""
    return pose is not None and bool(np.isfinite(pose).all())


def registered(edge: Attempt, source: View, target: View, pose: Array) -> Registration:
    """What mvreg says of a pose ``T_target_source`` (4, 4): the registration points that it pairs.

    The peers have points and residuals of their own; these, within two resolutions of the target
    or else the nearest one, are for observers and for comparison. What a peer's refinement
    minimised is not known here: `objective` is the mean squared distance too.
    """
    moved = se3.apply(pose, source.points)
    distances, partners = nearest(target.tree, moved, PAIRING_DISTANCE * target.resolution)
    chosen = np.flatnonzero(np.isfinite(distances))
    if not len(chosen):
        distances, partners = nearest(target.tree, moved)
        chosen = np.array([distances.argmin()])
    chosen = chosen[np.argsort(distances[chosen], kind="stable")]
    kept = distances[chosen]
    mse = float((kept**2).mean())
    return Registration(
        source.name, target.name, pose, len(chosen) / len(moved), mse, mse,
        np.stack([chosen, partners[chosen]], axis=1), kept, float(kept[-1]), edge.iterations,
        edge.converged,
    )  # fmt: skip


def placed(
    views: Sequence[View],
    clouds: Sequence[Cloud],
    found: Mapping[int, Array],
    pairs: tuple[Pair, ...],
    pipeline: Pipeline,
) -> Result:
    """The result, given the poses ``T_root_cloud`` (4, 4) of clouds; the root is the first.

    Scans without a pose are unregistered.
    """
    names = [view.name for view in views]
    poses = {names[0]: np.eye(4)}
    for index in sorted(set(found) - {0}):
        poses[names[index]] = in_scan_frames(found[index], clouds[index], clouds[0])
        pipeline.place(views[index], poses[names[index]])
    left = tuple(name for name in names if name not in poses)
    return Result(names[0], poses, left, pairs)
