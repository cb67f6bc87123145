"""What ``result.json`` holds: one plain dictionary about a run."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata

from mvreg.evaluate import Consistency, PoseErrors, ScanError, consistency, pose_errors
from mvreg.provenance import commit, machine
from mvreg.report_file import SCHEMA, to_plain
from mvreg.types import Pair, Result, ScanSet, View

#: What can change the answer. Open3D has two distributions, of which one is installed.
DISTRIBUTIONS = (
    "mvreg", "numpy", "scipy", "open3d", "open3d-cpu", "hydra-core", "pluggy", "rerun-sdk",
    "mvreg-comparators", "mvreg-peers", "kiss-matcher", "small-gicp",
)  # fmt: skip


def build_report(
    scanset: ScanSet,
    views: Sequence[View],
    result: Result,
    *,
    method: str,
    rng: int | None,
    seconds: Mapping[str, float],
    config: Mapping[str, object],
    interrupted: bool = False,
) -> dict[str, object]:
    """Everything that is to be remembered of a run.

    Parameters
    ----------
    scanset, views, result
        What went in, what was prepared, and what came out.
    method : str
        The method's name.
    rng : int or None
        The number that started the random generator.
    seconds : mapping
        Time by stage, and "load" and "total" (without loading and imports). What the pairs took
        per stage is added for the stages that it does not name.
    config : mapping
        The whole configuration, ready to run again.
    interrupted : bool
        The result is partial.

    Returns
    -------
    dict
        Only what JSON knows; numbers that are NaN or infinite have become None. Lengths are in
        `unit`, poses are ``T_model_scan``, row by row; `model_points` is the size of the merged
        view, None where the strategy keeps none.
    """
    errors = pose_errors(result.poses, scanset.poses, result.reference)
    complete = "incomplete" if result.unregistered else "complete"
    report = {
        "schema": SCHEMA,
        "status": "interrupted" if interrupted else complete,
        "method": method,
        "dataset": scanset.name,
        "rng": rng,
        "unit": scanset.unit,
        "resolution": views[0].scale.resolution if views else None,
        "reference": result.reference,
        "poses": dict(result.poses),
        "unregistered": list(result.unregistered),
        "num_pairs": len(result.pairs),
        "model_points": None if result.model is None else len(result.model.points),
        "seconds": {**pair_seconds(result.pairs), **seconds},
        "errors": _errors(errors),
        "consistency": _consistency(consistency(result.poses, views)),
        "scans": [_row(scan.name, result, errors) for scan in scanset.scans],
        "config": dict(config),
        "versions": versions(),
        "commit": commit(),
        "machine": machine(),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    plain: dict[str, object] = to_plain(report)
    return plain


def pair_seconds(pairs: Sequence[Pair]) -> dict[str, float]:
    """Time by stage, summed over the pairs."""
    total: dict[str, float] = {}
    for pair in pairs:
        for stage, seconds in pair.seconds.items():
            total[stage] = total.get(stage, 0.0) + seconds
    return total


def versions() -> dict[str, str]:
    """Versions of Python and of the distributions that matter; none of them is imported."""
    found = {"python": platform.python_version()}
    for name in DISTRIBUTIONS:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def telling_pair(name: str, result: Result) -> Pair | None:
    """The attempt that says most about a scan.

    For a placed scan the accepted pair that it came in with, as the source or, where a strategy
    grows a tree of scans, as the target; else the attempt that came closest to its threshold.
    """
    pairs = [pair for pair in result.pairs if name in (pair.source, pair.target)]
    if name in result.poses:
        accepted = [pair for pair in pairs if pair.verdict.reliable]
        as_source = [pair for pair in accepted if pair.source == name]
        last = (as_source or accepted)[-1:]
        return last[0] if last else None
    return min(pairs, key=_shortfall, default=None)


def _row(name: str, result: Result, errors: PoseErrors | None) -> dict[str, object]:
    pair = None if name == result.reference else telling_pair(name, result)
    placed = "reference" if name == result.reference else "placed"
    mse = pair.trimmed_mse if pair else None
    error = errors.scans.get(name) if errors else None
    return {
        "name": name,
        "status": placed if name in result.poses else "not placed",
        "attempts": sum(other.source == name for other in result.pairs),
        "overlap": pair.overlap if pair else None,
        "trimmed_rmse": math.sqrt(mse) if mse is not None else None,
        "reason": pair.verdict.reason if pair else None,
        "errors": _error(error) if error else None,
    }


def _shortfall(pair: Pair) -> float:
    verdict = pair.verdict
    ratio = verdict.score / verdict.threshold if verdict.threshold > 0 else math.inf
    return math.inf if math.isnan(ratio) else ratio


def _error(error: ScanError) -> dict[str, float]:
    return {
        "rotation": error.rotation,
        "angle_deg": error.angle,
        "translation": error.translation,
    }


def _errors(errors: PoseErrors | None) -> dict[str, object] | None:
    if errors is None:
        return None
    return {
        "frame": errors.frame,
        "mean": _error(errors.mean),
        "max": _error(errors.max),
        "scans": {name: _error(error) for name, error in errors.scans.items()},
    }


def _consistency(found: Consistency | None) -> dict[str, object] | None:
    if found is None:
        return None
    return {
        "median": found.median,
        "rms": found.rms,
        "median_resolutions": found.relative_median,
        "rms_resolutions": found.relative_rms,
        "points": found.points,
        "pairs": found.pairs,
    }
