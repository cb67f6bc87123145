"""Systematic errors of single scans, told from the pattern that they leave in the residuals.

A scan whose scale is off, or that is bent, lies on the others at no pose. The residuals of all
scans at the optimum tell how large the pattern would have to be in each of them for the least sum
of squares, the poses being free to follow: one step of Gauss-Newton in poses and patterns together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.adjust.joint.block_matrix import solver
from mvreg.stages.adjust.joint.covariance import DENSE
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import weight
from mvreg.stages.adjust.joint.rows import Rows
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.types import Array, Indices, Pattern

#: Unknowns of a scan: its pose, its scale, and how much it is bent.
SCALE, BEND, ALL = 6, 7, 8
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
#: A scan is seen from one side if its normals have a mean as long as this: others cannot be bent.
ONE_SIDED = 0.4


def patterns(
    found: Rows, surfaces: Sequence[Surface], motions: Array, held: Sequence[int], frame: Frame,
    width: float, size: float, variance: Callable[[Rows], float], graded: Sequence[Indices],
    names: Sequence[str], resolution: float,
) -> tuple[Pattern, ...]:  # fmt: skip
    """The patterns that are too large to be chance; see `pose_scatter` for the parameters.

    `size` is the variance of the residuals in their units, and `variance` tells that of others of
    the same contacts; `motions` (N, 4, 4) are of all `surfaces`.
    """
    count = len(surfaces)
    if not 3 <= count <= DENSE:  # of two scans nothing tells which is off
        return ()
    shapes = [_Shape(surface) for surface in surfaces]
    columns = _columns(found, shapes, motions, frame)
    values, residuals = np.zeros((count, ALL)), found.residuals
    told = list[Pattern]()
    for again in range(ROUNDS):
        kept = found.weights * weight(residuals, width)
        last = again == ROUNDS - 1
        classed = graded if last else ()
        normal, gradient, modes = _sums(found, columns, kept, residuals, classed, count)
        if last:
            size = variance(replace(found, residuals=residuals))
        prior = np.zeros((count, ALL))
        prior[:, SCALE:] = size / PRIOR**2
        prior[:, :SCALE] = LOOSE * normal.diagonal().max()
        prior[list(held), :SCALE] = STIFF * normal.diagonal().max()
        solve = solver(normal + np.diag(prior.ravel()), 0.0)
        inverse = size * solve(np.eye(count * ALL))
        if last:  # classes of points tell of chance once the patterns are taken out of them
            shared = solve(modes.reshape(-1, count * ALL).T)
            inverse += shared @ shared.T
        else:
            values = values - solve((gradient + prior * values).ravel()).reshape(count, ALL)
        whole = inverse.reshape(count, ALL, count, ALL)
        if last or not again:
            told = _told(shapes, values, whole, names, resolution, SURE if last else SUSPECT)
        if last or not told:
            break
        residuals = found.residuals + _changes(found, columns, values)
    return tuple(told)


def _columns(
    found: Rows, shapes: Sequence[_Shape], motions: Array, frame: Frame
) -> list[tuple[Array, Array]]:
    """For each way how its residuals change with the unknowns of source and target (m, 8)."""
    made = []
    for way, (source, target) in enumerate(found.contacts.ways.tolist()):
        rows = slice(*found.contacts.ends[way : way + 2])
        across = found.jacobian[rows, 3:] / frame.radius
        places = found.points[rows] * frame.radius + frame.centre
        one, other = (
            np.hstack([found.jacobian[rows], shapes[k].changes(motions[k], places, across)])
            for k in (source, target)
        )
        made.append((one, -other))
    return made


def _sums(
    found: Rows, columns: Sequence[tuple[Array, Array]], kept: Array, residuals: Array,
    graded: Sequence[Indices], count: int,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Normal equations (8 N, 8 N), their right-hand side (N, 8), and that of each class."""
    normal, gradient = np.zeros((count, ALL, count, ALL)), np.zeros((count, ALL))
    classes = [int(groups.max(initial=0)) + 1 for groups in graded]
    modes = [np.zeros((many, count, ALL)) for many in classes]
    for way, (pair, ends) in enumerate(zip(found.contacts.ways.tolist(), columns, strict=True)):
        rows = slice(*found.contacts.ends[way : way + 2])
        both = np.hstack(ends)
        weighted = kept[rows, None] * both
        found_here = (weighted.T @ both).reshape(2, ALL, 2, ALL)
        along = (weighted.T @ residuals[rows]).reshape(2, ALL)
        for a, k in enumerate(pair):
            gradient[k] += along[a]
            for b, other in enumerate(pair):
                normal[k, :, other] += found_here[a, :, b]
        for groups, many, sums in zip(graded, classes, modes, strict=True):
            apart = np.where(groups[rows, None] == np.arange(many), residuals[rows, None], 0.0)
            of_class = (apart.T @ weighted).reshape(many, 2, ALL)
            for a, k in enumerate(pair):
                sums[:, k] += of_class[:, a]
    size = count * ALL
    return normal.reshape(size, size), gradient, np.concatenate([np.zeros((0, count, ALL)), *modes])


def _changes(found: Rows, columns: Sequence[tuple[Array, Array]], values: Array) -> Array:
    """By how much the unknowns (N, 8) change the residuals (M,)."""
    return np.concatenate([
        one @ values[source] + other @ values[target]
        for (source, target), (one, other) in zip(found.contacts.ways, columns, strict=True)
    ])  # fmt: skip


def _told(
    shapes: Sequence[_Shape], values: Array, whole: Array, names: Sequence[str], resolution: float,
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


class _Shape:
    """What a scan would look like if its scale were off, or if it were bent."""

    def __init__(self, surface: Surface) -> None:
        self.middle = surface.points.mean(axis=0)
        apart = surface.points - self.middle
        self.size = float(np.sqrt((apart**2).sum(axis=1).mean())) or 1.0
        towards = surface.normals.mean(axis=0)
        self.one_sided = surface.oriented and float(np.linalg.norm(towards)) > ONE_SIDED
        self.out = towards / (float(np.linalg.norm(towards)) or 1.0)
        self.along = np.linalg.svd(towards[None])[2][1:]
        self.samples = apart

    def bent(self, apart: Array) -> Array:
        """How far a bend of one moves points about the middle (M, 3) along the view (M,)."""
        found: Array = ((self.along @ apart.T) ** 2).sum(axis=0) / self.size
        return found

    def moved(self, kind: str) -> float:
        """How far a pattern of one moves the samples, in the root mean square (length)."""
        if kind == "scale":
            return self.size
        return float(self.bent(self.samples).std())

    def changes(self, motion: Array, places: Array, across: Array) -> Array:
        """(M, 2): how residuals change with the scale and with the bend, for `across` (M, 3)."""
        apart = se3.apply(se3.invert(motion), places) - self.middle
        inward = across @ motion[:3, :3]
        scale = (inward * apart).sum(axis=1)
        bend = (inward @ self.out) * self.bent(apart) * self.one_sided
        return np.column_stack([scale, bend])
