"""Scans prepared for registration: down-sampled and described."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from mvreg import contracts, events
from mvreg.errors import InputError
from mvreg.execution.work import found_or_made
from mvreg.geometry.nearest import mean_spacing
from mvreg.parallel import in_threads, one_by_one
from mvreg.stage_calls import check_described, checked
from mvreg.store.content import UnknownContentError, digest, stage_digest, versions
from mvreg.store.folder import Store
from mvreg.surface.largest_range import without_largest_range
from mvreg.surface.normals import facing_normals
from mvreg.types import Sample, Scale, Scan, View
from mvreg.types.lazy import forget
from mvreg.types.scan import too_many_trees


def prepared(
    scans: Sequence[Scan],
    rng: np.random.Generator,
    downsample: contracts.Downsample,
    describe: contracts.Describe,
    store: Store,
    emit: events.Emit,
) -> list[View]:
    """The views of scans, see `mvreg.pipeline.Pipeline.prepare`."""
    names = [scan.name for scan in scans]
    twice = sorted({name for name in names if names.count(name) > 1})
    if len(scans) < 2 or twice:
        found = f"{len(scans)} scan(s)" if len(scans) < 2 else f"{', '.join(twice)} twice"
        raise InputError(f"expected at least two scans with different names, got {found}")
    scans = in_threads(_looked_at, scans)
    before = time.perf_counter()
    samples, spacing = checked("downsample", downsample)(scans, rng)
    seconds = {"downsample": time.perf_counter() - before}
    resolutions = in_threads(lambda sample: mean_spacing(sample.points), samples)
    describing = checked("describe", describe)
    many = too_many_trees(scans)
    scale = Scale(spacing, float(np.median([r for r in resolutions if r > 0] or [0.0])))

    def described(scan: Scan, sample: Sample, resolution: float) -> View:
        features, normals = found_or_made(
            store,
            lambda: described_key(describing, scan, sample, scale),
            lambda: described_anew(scan, sample, resolution),
        )
        if many:
            forget(scan, "tree")
        return View(scan.name, sample.points, normals, features, resolution, scale, scan)

    def described_anew(scan: Scan, sample: Sample, resolution: float) -> tuple[Any, ...]:
        features = describing(scan, sample.keypoints, spacing)
        return features, facing_normals(scan, sample.points, features, resolution)

    views = []
    each = list(zip(scans, samples, resolutions, strict=True))
    before = time.perf_counter()
    for index, view in enumerate(one_by_one(lambda one: described(*one), each)):
        seconds["describe"] = time.perf_counter() - before  # others are under way meanwhile
        emit(events.ViewPrepared(view, index, len(scans), seconds))
        views.append(view)
        seconds, before = {}, time.perf_counter()
    check_described(describe, views)
    return views


def _looked_at(scan: Scan) -> Scan:
    """The scan without what stands at the largest range, its spacing known: by one tree."""
    found = without_largest_range(scan)
    _ = found.spacing
    return found


def described_key(
    describe: contracts.Describe, scan: Scan, sample: Sample, scale: Scale
) -> str | None:
    """What the description of a scan is kept under."""
    try:
        return digest(versions(), "described", stage_digest(describe), scan, sample, scale)
    except UnknownContentError:
        return None
