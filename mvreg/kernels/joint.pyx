# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Curved patches on surfaces: asked for distances, and summed up to equations."""

from libc.math cimport fabs, floor, fmin, sqrt
from libc.stdint cimport int64_t
from libc.string cimport memcpy
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, cross, move, of_array, turn
from mvreg.kernels.tree cimport Tree

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# No surface has so many samples.
cdef enum:
    FARTHEST = 1 << 30

cdef struct Patch:
    double point[3]
    double axes[9]
    double slope[2]
    double bend[3]
    double normal[3]
    double reach
    bint whole

# Which contacts count; how far apart they may be is squared.
cdef struct Gate:
    double squared
    double least_cosine
    Py_ssize_t stride
    bint flat
    bint oriented

# What rows are asked about, and in which unit (its inverse).
cdef struct About:
    double centre[3]
    double unit
    bint flat


cdef class Patches:
    """The patches of one surface, side by side in memory; for their meaning see `Surface`.

    Parameters
    ----------
    tree : Tree
        Of the points.
    points, normals : (S, 3) arrays
    axes : (S, 3, 3) array
    slopes : (S, 2) array
    bends : (S, 3) array
    reach : (S,) array
    whole : (S,) array of bool
    """

    cdef Tree tree
    cdef vector[Patch] patch
    cdef Py_ssize_t size

    def __cinit__(
        self, Tree tree not None, points, axes, slopes, bends, normals, reach, whole
    ):
        # What is found in the tree is looked up among the patches.
        cdef const double[:, ::1] points_ = checks.floats("points", points, tree.n, 3)
        cdef const double[:, :, ::1] axes_ = checks.floats("axes", axes, tree.n, 3, 3)
        cdef const double[:, ::1] slopes_ = checks.floats("slopes", slopes, tree.n, 2)
        cdef const double[:, ::1] bends_ = checks.floats("bends", bends, tree.n, 3)
        cdef const double[:, ::1] normals_ = checks.floats("normals", normals, tree.n, 3)
        cdef const double[::1] reach_ = checks.floats("reach", reach, tree.n)
        cdef const unsigned char[::1] whole_ = flags("whole", whole, tree.n)
        cdef Py_ssize_t k
        cdef Patch* one
        self.tree = tree
        self.size = points_.shape[0]
        self.patch.resize(self.size)
        for k in range(self.size):
            one = &self.patch[k]
            memcpy(one.point, &points_[k, 0], 3 * sizeof(double))
            memcpy(one.axes, &axes_[k, 0, 0], 9 * sizeof(double))
            memcpy(one.slope, &slopes_[k, 0], 2 * sizeof(double))
            memcpy(one.bend, &bends_[k, 0], 3 * sizeof(double))
            memcpy(one.normal, &normals_[k, 0], 3 * sizeof(double))
            one.reach, one.whole = reach_[k], whole_[k]


cdef inline double height(
    const Patch* patch, const double* x, bint flat, double* normal, double* aside
) noexcept nogil:
    """How far a point is from a patch; the surface's normal there; how far along it (squared)."""
    cdef double local[3]
    cdef double gap[3]
    cdef double a, b, below, first = patch.slope[0], second = patch.slope[1], bent, other, shallow
    cdef int m
    for m in range(3):
        gap[m] = x[m] - patch.point[m]
    for m in range(3):
        local[m] = (patch.axes[3 * m] * gap[0] + patch.axes[3 * m + 1] * gap[1]
                    + patch.axes[3 * m + 2] * gap[2])
    a, b = local[0], local[1]
    below = first * a + second * b
    if not flat:
        bent = patch.bend[0] * a + patch.bend[1] * b
        other = patch.bend[1] * a + patch.bend[2] * b
        below += (bent * a + other * b) / 2
        first, second = first + bent, second + other
    shallow = 1 / sqrt(1 + (first * first + second * second))
    for m in range(3):
        normal[m] = shallow * (
            patch.axes[6 + m] - first * patch.axes[m] - second * patch.axes[3 + m])
    aside[0] = a * a + b * b
    return shallow * (local[2] - below)


def gaps(Patches surface not None, points, patches, bint flat):
    """How far points are from patches, across the surface and along it.

    Parameters
    ----------
    surface : Patches
    points : (M, 3) array
    patches : (M,) array
        One for each point.
    flat : bool
        Ask the tangent planes instead.

    Returns
    -------
    heights : (M,) array
        Signed distances to the surface, to first order.
    normals : (M, 3) array
        Of the surface below the points, unit.
    aside : (M,) array
        How far the points are from the middle of the patch, along it.
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "M", 3)
    cdef const Py_ssize_t[::1] which = checks.indices("patches", patches, surface.size, "M")
    cdef Py_ssize_t size = which.shape[0], k
    if given.shape[0] != size:
        raise ValueError(f"expected points for {size} patches, got {given.shape[0]}")
    heights, normals, aside = np.empty(size), np.empty((size, 3)), np.empty(size)
    cdef double[::1] high = heights, far = aside
    cdef double[:, ::1] normal = normals
    with nogil:
        for k in range(size):
            high[k] = height(&surface.patch[which[k]], &given[k, 0], flat, &normal[k, 0], &far[k])
            far[k] = sqrt(far[k])
    return heights, normals, aside


def contacts(
    surfaces, motions, ways, double reach, Py_ssize_t stride, bint flat, double least_cosine,
    oriented
):
    """Where the samples of surfaces lie on the patches of others.

    A sample finds the patch whose origin is nearest; both must be whole, and the normals agree.

    Parameters
    ----------
    surfaces : sequence of Patches
        N of them.
    motions : (N, 4, 4) array
        From the surfaces' frames to a common one.
    ways : (W, 2) array
        Positions of sources and of targets among the surfaces.
    reach : float
        No patch whose origin is farther away counts.
    stride : int
        Every n-th sample is used.
    flat : bool
        Ask tangent planes, however far away from their middle; else a sample must lie on the patch
        no farther along than the patch reaches.
    least_cosine : float
        Of the angle between the normals.
    oriented : (N,) array of bool
        Whether the normals' signs mean anything; they must for both.

    Returns
    -------
    ends : (W + 1,) array
        Where the contacts of each way begin, and where those of the last one end.
    samples, patches : (M,) arrays
        Their positions in the source and in the target, samples ascending.
    """
    cdef Py_ssize_t count = len(surfaces), w
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = among(ways, count)
    cdef const unsigned char[::1] signs = flags("oriented", oriented, "N")
    cdef vector[Py_ssize_t] samples, patches
    cdef Patches source, target
    cdef Gate gate
    if stride < 1:
        raise ValueError(f"expected a stride of 1 or more, got {stride}")
    if signs.shape[0] != count:
        raise ValueError(f"expected to know of {count} surfaces, got {signs.shape[0]}")
    gate.squared = fmin(reach, 1e150) * fmin(reach, 1e150)
    gate.stride, gate.flat, gate.least_cosine = min(stride, FARTHEST), flat, least_cosine
    ends = np.zeros(way.shape[0] + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] end = ends
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        gate.oriented = signs[way[w, 0]] and signs[way[w, 1]]
        with nogil:
            touch(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]], &gate,
                  samples, patches)
        end[w + 1] = samples.size()
    return ends, of_vector(samples), of_vector(patches)


cdef void touch(
    Patches source, Patches target, const double* from_source, const double* from_target,
    const Gate* gate, vector[Py_ssize_t]& samples, vector[Py_ssize_t]& patches
) noexcept nogil:
    """Add the contacts of one surface with another."""
    cdef Motion motion
    cdef double x[3]
    cdef double squared
    cdef Py_ssize_t asked, k, found
    cdef const Patch* here
    between(from_source, from_target, motion)
    for asked in range((source.size + gate.stride - 1) // gate.stride):
        k = gate.stride * asked
        here = &source.patch[k]
        if here.whole:
            move(motion, here.point, x)
            squared = gate.squared
            found = target.tree.find(x, &squared)
            if found >= 0 and agree(here, &target.patch[found], x, motion, gate):
                samples.push_back(k)
                patches.push_back(found)


cdef inline bint agree(
    const Patch* here, const Patch* there, const double* x, const double* motion, const Gate* gate
) noexcept nogil:
    """Whether a sample, moved to x, lies on the patch that is nearest."""
    cdef double normal[3]
    cdef double turned[3]
    cdef double aside, cosine
    if not there.whole:
        return False
    height(there, x, gate.flat, normal, &aside)
    if not gate.flat and aside > there.reach * there.reach:
        return False
    turn(motion, here.normal, turned)
    cosine = turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2]
    return (cosine if gate.oriented else fabs(cosine)) > gate.least_cosine


def rows(
    surfaces, motions, ways, ends, samples, patches, centre, double radius, bint flat,
    double[::1] residuals not None, double[:, ::1] jacobian not None,
    double[:, ::1] points not None
):
    """How far samples are from patches, and how that changes with the source's motion.

    Parameters
    ----------
    surfaces, motions, ways, ends, samples, patches
        As `contacts` takes and gives them; ways and ends may be those of some ways only.
    centre : (3,) array
    radius : float
        Answers are about this point of the common frame, in units of this length.
    flat : bool
        Ask the tangent planes instead.
    residuals : (M,) array
        Filled where the ways have contacts.
    jacobian : (M, 6) array
        So is this. Of the residuals: for a turn about the centre, and a shift in units of the
        radius.
    points : (M, 3) array
        And this: where the samples are.
    """
    cdef Py_ssize_t count = len(surfaces), size = residuals.shape[0], w, k, wrong = -1
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = among(ways, count)
    cdef const Py_ssize_t[::1] end = bounds(ends, way.shape[0], size)
    cdef const Py_ssize_t[::1] here = checks.integers("samples", samples, "M")
    cdef const Py_ssize_t[::1] there = checks.integers("patches", patches, "M")
    cdef const double[::1] middle = floats(centre)
    cdef Patches source, target
    cdef About about
    if not here.shape[0] == there.shape[0] == jacobian.shape[0] == points.shape[0] == size:
        raise ValueError(f"expected {size} samples, patches and rows, got {here.shape[0]}, "
                         f"{there.shape[0]}, {jacobian.shape[0]} and {points.shape[0]}")
    if jacobian.shape[1] != 6 or points.shape[1] != 3 or middle.shape[0] != 3:
        raise ValueError("expected rows of 6, points and a centre of 3 numbers")
    about.unit, about.flat = 1 / radius, flat
    memcpy(about.centre, &middle[0], 3 * sizeof(double))
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        if end[w] == end[w + 1]:
            continue
        with nogil:
            for k in range(end[w], end[w + 1]):
                if not (0 <= here[k] < source.size and 0 <= there[k] < target.size):
                    wrong = k
                    break
            else:
                fill(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]],
                     end[w + 1] - end[w], &here[end[w]], &there[end[w]], &about,
                     &residuals[end[w]], &jacobian[end[w], 0], &points[end[w], 0])
        if wrong >= 0:
            raise ValueError(
                f"expected positions among {source.size} samples and {target.size} patches, "
                f"got {here[wrong]} and {there[wrong]}")


cdef void fill(
    Patches source, Patches target, const double* from_source, const double* from_target,
    Py_ssize_t size, const Py_ssize_t* samples, const Py_ssize_t* patches, const About* about,
    double* residuals, double* jacobian, double* points
) noexcept nogil:
    """The rows of one surface on another."""
    cdef Motion into
    cdef double x[3]
    cdef double inward[3]
    cdef double aside
    cdef double* p
    cdef double* n
    cdef Py_ssize_t k
    cdef int m
    between(from_source, from_target, into)
    for k in range(size):
        move(into, source.patch[samples[k]].point, x)
        residuals[k] = height(
            &target.patch[patches[k]], x, about.flat, inward, &aside) * about.unit
        n, p = jacobian + (6 * k + 3), points + 3 * k
        turn(from_target, inward, n)
        move(from_target, x, p)
        for m in range(3):
            p[m] = (p[m] - about.centre[m]) * about.unit
        cross(p, n, n - 3)


def normal_equations(jacobian, residuals, weights, ends, double width, double cut):
    """The weighted sums ``J^T W J`` and ``J^T W r`` over each way's rows.

    Parameters
    ----------
    jacobian : (M, 6) array
    residuals, weights : (M,) arrays
        Each weight is multiplied by ``(1 + u^2)^-2`` for the residual u in units of the width.
    ends : (W + 1,) array
        Where the rows of each way begin, and where those of the last one end.
    width, cut : float
        Residuals beyond so many widths have no weight.

    Returns
    -------
    normals : (W, 6, 6) array
    gradients : (W, 6) array
    """
    cdef const double[:, ::1] row = floats(jacobian)
    cdef const double[::1] residual = floats(residuals), weight = floats(weights)
    cdef Py_ssize_t size = row.shape[0], count = len(ends) - 1, w, k
    cdef const Py_ssize_t[::1] end = bounds(ends, count, size)
    cdef double square, share, most = cut * cut, slope
    cdef double* sums
    cdef double* slopes
    cdef int m, n
    if row.shape[1] != 6 or residual.shape[0] != size or weight.shape[0] != size:
        raise ValueError(f"expected (M, 6), (M,), (M,), got {np.shape(jacobian)}, "
                         f"{np.shape(residuals)}, {np.shape(weights)}")
    normals, gradients = np.zeros((count, 6, 6)), np.zeros((count, 6))
    cdef double[:, :, ::1] normal = normals
    cdef double[:, ::1] gradient = gradients
    with nogil:
        for w in range(count):
            sums, slopes = &normal[w, 0, 0], &gradient[w, 0]
            for k in range(end[w], end[w + 1]):
                square = (residual[k] / width) * (residual[k] / width)
                if not square < most:
                    continue
                share = weight[k] / ((1 + square) * (1 + square))
                for m in range(6):
                    slope = share * row[k, m]
                    slopes[m] += slope * residual[k]
                    for n in range(m + 1):
                        sums[6 * m + n] += slope * row[k, n]
            for m in range(6):
                for n in range(m):
                    sums[6 * n + m] = sums[6 * m + n]
    return normals, gradients


def cell_sums(jacobian, residuals, weights, points, ends, double width, double cut, low,
              double edge, across):
    """The gradients ``J^T W r`` of each way's residuals in every cell of a grid, weighted as above.

    Parameters
    ----------
    jacobian, residuals, weights, ends, width, cut
        As in `normal_equations`.
    points : (M, 3) array
        Where the residuals are.
    low : (3,) array
        Where the grid begins: no point is lower.
    edge : float
        Of its cells.
    across : (3,) array
        How many cells there are along x, y, z.

    Returns
    -------
    ends : (W + 1,) array
        Where the cells of each way begin, and where those of the last one end.
    cells : (C,) array
        Numbers of the cells in which a way has residuals, ascending.
    sums : (C, 6) array
    """
    cdef const double[:, ::1] row = floats(jacobian), point = checks.floats("points", points, "M", 3)
    cdef const double[::1] residual = floats(residuals), weight = floats(weights)
    cdef const double[::1] start = checks.floats("low", low, 3)
    cdef const int64_t[::1] size = checks.floats("across", across, 3, finite=True).astype(np.int64)
    cdef Py_ssize_t rows_ = row.shape[0], count = len(ends) - 1, w, k, one
    cdef const Py_ssize_t[::1] end = bounds(ends, count, rows_)
    cdef vector[pair[int64_t, Py_ssize_t]] order
    cdef vector[int64_t] cells
    cdef vector[double] sums
    cdef double square, share
    cdef double* slopes = NULL
    cdef int64_t key
    cdef int m
    if not row.shape[1] == 6 or not rows_ == residual.shape[0] == weight.shape[0] == point.shape[0]:
        raise ValueError(f"expected (M, 6), (M,), (M,), (M, 3), got {np.shape(jacobian)}, "
                         f"{np.shape(residuals)}, {np.shape(weights)}, {np.shape(points)}")
    checks.positive(edge=edge)
    last = np.zeros(count + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] last_ = last
    with nogil:
        for w in range(count):
            order.resize(end[w + 1] - end[w])
            for k in range(end[w], end[w + 1]):
                key = 0
                for m in range(3):
                    key = key * size[m] + <int64_t> floor((point[k, m] - start[m]) / edge)
                order[k - end[w]].first, order[k - end[w]].second = key, k
            sort(order.begin(), order.end())
            for k in range(end[w + 1] - end[w]):
                one = order[k].second
                if k == 0 or order[k].first != order[k - 1].first:
                    cells.push_back(order[k].first)
                    sums.resize(6 * cells.size(), 0.0)
                    slopes = &sums[6 * cells.size() - 6]
                square = (residual[one] / width) * (residual[one] / width)
                if square < cut * cut:
                    share = weight[one] * residual[one] / ((1 + square) * (1 + square))
                    for m in range(6):
                        slopes[m] += share * row[one, m]
            last_[w + 1] = cells.size()
    found = np.empty(cells.size(), dtype=np.int64), np.empty((cells.size(), 6))
    cdef int64_t[::1] cell = found[0]
    cdef double[:, ::1] sum_ = found[1]
    if cells.size():
        memcpy(&cell[0], cells.data(), cells.size() * sizeof(int64_t))
        memcpy(&sum_[0, 0], sums.data(), sums.size() * sizeof(double))
    return last, *found


def farthest(points, before, after):
    """How far a motion goes from another for any of points (N, 3), at most; 0 for no points."""
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3)
    cdef Motion change
    cdef double x[3]
    cdef double most = 0, squared
    cdef Py_ssize_t k
    of_array(floats(np.asarray(after) - np.asarray(before)), change)
    with nogil:
        for k in range(given.shape[0]):
            move(change, &given[k, 0], x)
            squared = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
            most = squared if squared > most else most
    return sqrt(most)


cdef floats(values):
    return np.ascontiguousarray(values, dtype=np.float64)


cdef flags(name, values, size):
    """Truth values (size,), one byte each."""
    found = np.ascontiguousarray(values, dtype=bool).view(np.uint8)
    if found.ndim != 1 or (size != "N" and len(found) != size):
        raise InputError(f"{name}: expected shape ({size},), got {found.shape}")
    return found


cdef Patches one_of(surfaces, Py_ssize_t k):
    surface = surfaces[k]
    if not isinstance(surface, Patches):
        raise TypeError(f"surfaces: expected Patches, got {type(surface).__name__} at {k}")
    return surface


cdef of_vector(vector[Py_ssize_t]& values):
    found = np.empty(values.size(), dtype=np.intp)
    cdef Py_ssize_t[::1] view = found
    if values.size():
        memcpy(&view[0], values.data(), values.size() * sizeof(Py_ssize_t))
    return found


cdef vector[double] placed(motions, Py_ssize_t count) except *:
    """The motions of so many surfaces, twelve numbers each."""
    cdef const double[:, :, ::1] given = floats(motions)
    cdef vector[double] found
    cdef Py_ssize_t k
    if given.shape[0] != count:
        raise ValueError(f"expected {count} motions, got {given.shape[0]}")
    found.resize(12 * count)
    for k in range(count):
        of_array(given[k], &found[12 * k])
    return found


cdef among(ways, Py_ssize_t count):
    """Pairs (W, 2) of positions that are safe to look up among so many."""
    if np.ndim(ways) != 2 or np.shape(ways)[1] != 2:
        raise InputError(f"expected ways (W, 2), got {np.shape(ways)}")
    return checks.indices("ways", ways, count, "W", 2)


cdef bounds(ends, Py_ssize_t count, Py_ssize_t size):
    """Where each of so many ways begins, and the last one ends, within `size`."""
    found = checks.ends("ends", ends, size)
    if len(found) != count + 1:
        raise InputError(f"expected the ends of {count} ways, got {len(found)} numbers")
    return found


cdef void between(
    const double* from_source, const double* from_target, double* motion
) noexcept nogil:
    """``T_target_source``."""
    cdef int i, j, m
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = 0
            for m in range(3):
                motion[3 * i + j] += from_target[3 * m + i] * from_source[3 * m + j]
        motion[9 + i] = 0
        for m in range(3):
            motion[9 + i] += from_target[3 * m + i] * (from_source[9 + m] - from_target[9 + m])
