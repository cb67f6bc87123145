"""How certain the pose of one scan is relative to another."""

from __future__ import annotations

from mvreg.errors import InputError
from mvreg.stages.adjust.joint.covariance import relative_covariance as between
from mvreg.types import Array, Result


def relative_covariance(result: Result, source: str, target: str) -> Array:
    """The covariance of the pose of one scan relative to another, linked or not.

    Of linked scans it is also `Link.covariance`; of a scan and the one that holds the frame, what
    `Result.covariances` says of the scan, in the other's frame.

    Parameters
    ----------
    result : Result
        With the `scatter` that an adjustment leaves: ``adjust=joint``, the default.
    source, target : str
        Two scans of one model.

    Returns
    -------
    (6, 6) array
        Of the small motion ``exp(twist) @ T_target_source`` with
        ``x_target = T_target_source @ x_source``, in the target's frame: three of rotation
        (radians) before three of translation (length).

    Raises
    ------
    InputError
        If the result does not tell how the two err together.

    Examples
    --------
    >>> result = mvreg.register(scans)
    >>> covariance = mvreg.relative_covariance(result, "scan_03", "scan_17")
    """
    models = (result.poses, *result.components)
    for name in (source, target):
        if not any(name in poses for poses in models):
            known = ", ".join(name for poses in models for name in poses)
            raise InputError(
                f"relative_covariance: {name!r} has no pose; expected one of {known or 'none'}"
            )
    for poses in models:
        if source not in poses:
            continue
        if target not in poses:
            raise InputError(
                f"relative_covariance: {source!r} and {target!r} are in different models; "
                "expected two scans of one: nothing tells their relative pose"
            )
        for scatter in result.scatter:
            if {source, target} <= {*scatter.names, *scatter.fixed}:
                return between(scatter, source, target, poses[target])
    raise InputError(
        f"relative_covariance: the result does not tell how {source!r} and {target!r} err; "
        "expected scans that adjust=joint has joined by contacts"
    )
