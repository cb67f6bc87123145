"""Every partial model by itself: what all adjustments share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mvreg.types import Result


def over_components(result: Result, improve: Callable[[Result], Result]) -> Result:
    """The result with every partial model improved by itself, each in its own frame.

    Parameters
    ----------
    result : Result
        Its covariances and links belong to the old poses, and do not outlast them.
    improve : function of Result to Result
        Gets one partial model at a time, without `components`, its first scan as the `reference`,
        whose pose has to stay. Returns what it was given, the same object, to change nothing.

    Returns
    -------
    Result
        The `result` itself where nothing has changed.
    """
    parts = [
        replace(
            result, components=(), covariances={}, links=(), scatter=(), patterns=(), scales=()
        ),
        *(Result(next(iter(poses)), poses, (), ()) for poses in result.components),
    ]
    found = [improve(part) for part in parts]
    if all(new is old for new, old in zip(found, parts, strict=True)):
        return result
    return replace(
        found[0],
        components=tuple(part.poses for part in found[1:]),
        covariances={name: c for part in found for name, c in part.covariances.items()},
        links=tuple(link for part in found for link in part.links),
        patterns=tuple(pattern for part in found for pattern in part.patterns),
        scales=tuple(scale for part in found for scale in part.scales),
        scatter=tuple(scatter for part in found for scatter in part.scatter),
    )
