"""Systematic errors of single scans, told from the pattern that they leave in the residuals.

A scan whose scale is off, or that is bent, lies on the others at no pose. The residuals of all
scans at the optimum tell how large the pattern would have to be in each of them for the least sum
of squares, the poses being free to follow: one step of Gauss-Newton in poses and patterns together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mvreg.stages.adjust.joint.block_matrix import solver
from mvreg.stages.adjust.joint.covariance import DENSE
from mvreg.stages.adjust.joint.extended import ALL, BEND, SCALE, Extended, Shape
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.types import Array, Indices, Pattern

#: Before anything is seen: a scale is right to this, and a bend no deeper than so much of the scan.
#: Only holds what cannot be seen: the scale of all scans together, and how they all are bent.
PRIOR = 1e-2
#: Told are patterns of so many standard deviations, told by few classes, which move points by so
#: much (resolutions). On real scans of the Stanford sets the largest has 5.8.
SURE, SEEN = 7.0, 0.001
#: What holds a pose that is held, in units of the largest of what holds the others.
STIFF = 1e6
#: What holds a pose that nothing else does, in the same unit: scans that touch no other.
LOOSE = 1e-9
#: Rounds of reweighting: what a pattern puts at the edge of the kernel counts for too little at
#: first. There are others only if the first one finds something of so many deviations, by noise.
ROUNDS, SUSPECT = 5, 4.0
#: Patterns that the last round has moved by less than this share of the largest are at rest.
RESTED = 0.002


def patterns(
    extended: Extended, held: Sequence[int], width: float, size: float,
    variance: Callable[[Rows | Residuals], float], graded: Sequence[Callable[[Rows], Indices]],
    names: Sequence[str], resolution: float,
) -> tuple[Pattern, ...]:  # fmt: skip
    """The patterns that are too large to be chance; see `pose_scatter` for the parameters.

    `size` is the variance of the residuals in their units, and `variance` tells that of others of
    the same contacts.
    """
    shapes, count = extended.shapes, len(extended.shapes)
    if not 3 <= count <= DENSE:  # of two scans nothing tells which is off
        return ()
    values, rested = np.zeros((count, ALL)), False
    told = list[Pattern]()
    for again in range(ROUNDS):
        last = rested or again == ROUNDS - 1
        sums = extended.sums(values, width, graded if last else ())
        if last:
            size = variance(replace(extended.found, residuals=sums.residuals))
        prior = priors(sums.normal, held, size)
        solve = solver(sums.normal + np.diag(prior.ravel()), 0.0)
        if not last:
            step = solve((sums.gradient + prior * values).ravel()).reshape(count, ALL)
            values = values - step
        if last or not again:  # classes tell of chance once the patterns are taken out of them
            whole = scatter(solve, size, sums.modes)
            told = _told(shapes, values, whole, names, resolution, SURE if last else SUSPECT)
        if last or not told:
            break
        moved, largest = (np.abs(each[:, SCALE:]).max(axis=0) for each in (step, values))
        rested = bool((moved <= RESTED * largest).all())
    return tuple(told)


def priors(normal: Array, held: Sequence[int], size: float) -> Array:
    """(N, 8): what holds the unknowns besides the normal equations (8 N, 8 N)."""
    found = np.zeros((len(normal) // ALL, ALL))
    found[:, SCALE:] = size / PRIOR**2
    found[:, :SCALE] = LOOSE * normal.diagonal().max()
    found[list(held), :SCALE] = STIFF * normal.diagonal().max()
    return found


def scatter(solve: Callable[[Array], Array], size: float, modes: Array) -> Array:
    """Covariance (N, 8, N, 8) of the unknowns, of the residuals' variance and sums of classes."""
    count = modes.shape[1]
    found = size * solve(np.eye(count * ALL))
    if len(modes):
        shared = solve(modes.reshape(-1, count * ALL).T)
        found += shared @ shared.T
    return found.reshape(count, ALL, count, ALL)


def _told(
    shapes: Sequence[Shape], values: Array, whole: Array, names: Sequence[str], resolution: float,
    sure: float,
) -> list[Pattern]:  # fmt: skip
    """The patterns of so many deviations as is `sure`, against the median scan."""
    told = []
    for kind, at in (("scale", SCALE), ("bend", BEND)):
        chosen = [k for k, shape in enumerate(shapes) if kind == "scale" or shape.one_sided]
        if len(chosen) < 3:
            continue
        beside = np.eye(len(chosen)) - 1 / len(chosen)
        own = values[chosen, at] - np.median(values[chosen, at])
        scatter = beside @ whole[chosen, at][:, chosen, at] @ beside
        for k, value, square in zip(chosen, own, scatter.diagonal(), strict=True):
            deviation, size = float(np.sqrt(square)), shapes[k].moved(kind)
            if abs(value) > sure * deviation and abs(value) * size > SEEN * resolution:
                unit = 1.0 if kind == "scale" else size
                told.append(Pattern(names[k], kind, -float(value) * unit, deviation * unit))
    return told
