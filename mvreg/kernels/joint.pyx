# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Curved patches on surfaces: fitted to points, asked for distances, and summed up to equations."""

from libc.math cimport INFINITY, fabs, fmax, sqrt
from libc.string cimport memcpy
from libcpp.algorithm cimport nth_element
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, move, solve, squared_gap
from mvreg.kernels.tree cimport Tree, box_distance

import numpy as np

cdef enum:
    MOST = 128  # neighbours of a sample

# A point of a tree: how far it is (squared), and its place among the tree's entries.
ctypedef pair[double, Py_ssize_t] Near
# As much farther than the last one's are the next sample's neighbours looked for (squared).
cdef double GUESS = 1.4

cdef struct Patch:
    double point[3]
    double axes[9]
    double slope[2]
    double bend[3]
    double normal[3]
    double reach
    bint whole


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

    def __init__(self, Tree tree, points, axes, slopes, bends, normals, reach, whole):
        cdef const double[:, ::1] points_ = floats(points), slopes_ = floats(slopes)
        cdef const double[:, ::1] bends_ = floats(bends), normals_ = floats(normals)
        cdef const double[:, :, ::1] axes_ = floats(axes)
        cdef const double[::1] reach_ = floats(reach)
        cdef const unsigned char[::1] whole_ = np.ascontiguousarray(whole, dtype=np.uint8)
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
    cdef double a, b, below, first = patch.slope[0], second = patch.slope[1], bent, other, steep
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
    steep = sqrt(1 + (first * first + second * second))
    for m in range(3):
        normal[m] = (patch.axes[6 + m] - first * patch.axes[m] - second * patch.axes[3 + m]) / steep
    aside[0] = a * a + b * b
    return (local[2] - below) / steep


def gaps(Patches surface, points, patches, bint flat):
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
    cdef const double[:, ::1] given = floats(points)
    cdef const Py_ssize_t[::1] which = positions(patches, surface.size)
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
    Patches source, Patches target, transform, double reach, Py_ssize_t stride, bint flat,
    double least_cosine, bint oriented
):
    """Where the samples of a surface lie on the patches of another.

    A sample finds the patch whose origin is nearest; both must be whole, and the normals agree.

    Parameters
    ----------
    source, target : Patches
    transform : (4, 4) array
        ``T_target_source``.
    reach : float
        No patch whose origin is farther away counts.
    stride : int
        Every so-manieth sample is asked.
    flat : bool
        Ask tangent planes, however far away from their middle; else a sample must lie on the patch
        no farther along than the patch reaches.
    least_cosine : float
        Of the angle between the normals.
    oriented : bool
        Whether the normals' signs mean anything.

    Returns
    -------
    samples, patches : (M,) arrays
        Their positions, samples ascending.
    """
    cdef Motion motion
    cdef double x[3]
    cdef double normal[3]
    cdef double turned[3]
    cdef double squared, aside, cosine, most = reach * reach if reach < 1e150 else 1e300
    cdef vector[Py_ssize_t] samples, patches
    cdef Py_ssize_t k, found
    cdef const Patch* here
    cdef const Patch* there
    of_array(transform, motion)
    if stride < 1:
        raise ValueError(f"expected a stride of 1 or more, got {stride}")
    with nogil:
        for k in range((source.size + stride - 1) // stride):
            here = &source.patch[stride * k]
            if not here.whole:
                continue
            move(motion, here.point, x)
            squared = most
            found = target.tree.find(x, &squared)
            if found < 0:
                continue
            there = &target.patch[found]
            if not there.whole:
                continue
            height(there, x, flat, normal, &aside)
            if not flat and aside > there.reach * there.reach:
                continue
            turn(motion, here.normal, turned)
            cosine = turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2]
            if (cosine if oriented else fabs(cosine)) > least_cosine:
                samples.push_back(stride * k)
                patches.push_back(found)
    return of_vector(samples), of_vector(patches)


def rows(
    Patches source, Patches target, source_motion, target_motion, samples, patches, centre,
    double radius, bint flat
):
    """How far samples are from patches, and how that changes with the source's motion.

    Parameters
    ----------
    source, target : Patches
    source_motion, target_motion : (4, 4) arrays
        From the surfaces' frames to a common one.
    samples, patches : (M,) arrays
        Positions in the source and in the target.
    centre : (3,) array
    radius : float
        Answers are about this point of the common frame, in units of this length.
    flat : bool
        Ask the tangent planes instead.

    Returns
    -------
    residuals : (M,) array
    jacobian : (M, 6) array
        Of the residuals: for a turn about the centre, and a shift in units of the radius.
    points : (M, 3) array
        Where the samples are.
    """
    cdef Motion into, out
    cdef const Py_ssize_t[::1] here = positions(samples, source.size)
    cdef const Py_ssize_t[::1] there = positions(patches, target.size)
    cdef const double[::1] middle = floats(centre)
    cdef Py_ssize_t size = here.shape[0], k
    cdef double x[3]
    cdef double inward[3]
    cdef double aside
    cdef double* p
    cdef double* n
    cdef int m
    if there.shape[0] != size:
        raise ValueError(f"expected a patch for each of {size} samples, got {there.shape[0]}")
    residuals, jacobian, points = np.empty(size), np.empty((size, 6)), np.empty((size, 3))
    cdef double[::1] residual = residuals
    cdef double[:, ::1] row = jacobian, point = points
    between(source_motion, target_motion, into)
    of_array(target_motion, out)
    with nogil:
        for k in range(size):
            move(into, source.patch[here[k]].point, x)
            residual[k] = height(&target.patch[there[k]], x, flat, inward, &aside) / radius
            n, p = &row[k, 3], &point[k, 0]
            turn(out, inward, n)
            move(out, x, p)
            for m in range(3):
                p[m] = (p[m] - middle[m]) / radius
            row[k, 0] = p[1] * n[2] - p[2] * n[1]
            row[k, 1] = p[2] * n[0] - p[0] * n[2]
            row[k, 2] = p[0] * n[1] - p[1] * n[0]
    return residuals, jacobian, points


def normal_equations(jacobian, residuals, weights, double width, double cut):
    """The weighted sums ``J^T W J`` and ``J^T W r``.

    Parameters
    ----------
    jacobian : (M, 6) array
    residuals, weights : (M,) arrays
        Each weight is multiplied by ``(1 + u^2)^-2`` for the residual u in units of the width.
    width, cut : float
        Residuals beyond so many widths have no weight.

    Returns
    -------
    normal : (6, 6) array
    gradient : (6,) array
    """
    cdef const double[:, ::1] row = floats(jacobian)
    cdef const double[::1] residual = floats(residuals), weight = floats(weights)
    cdef Py_ssize_t size = row.shape[0], k
    cdef double square, share, most = cut * cut, slope
    cdef int m, n
    if row.shape[1] != 6 or residual.shape[0] != size or weight.shape[0] != size:
        raise ValueError(f"expected (M, 6), (M,), (M,), got {np.shape(jacobian)}, "
                         f"{np.shape(residuals)}, {np.shape(weights)}")
    normal, gradient = np.zeros((6, 6)), np.zeros(6)
    cdef double[:, ::1] sums = normal
    cdef double[::1] slopes = gradient
    with nogil:
        for k in range(size):
            square = (residual[k] / width) * (residual[k] / width)
            if not square < most:
                continue
            share = weight[k] / ((1 + square) * (1 + square))
            for m in range(6):
                slope = share * row[k, m]
                slopes[m] += slope * residual[k]
                for n in range(m + 1):
                    sums[m, n] += slope * row[k, n]
        for m in range(6):
            for n in range(m):
                sums[n, m] = sums[m, n]
    return normal, gradient


def farthest(points, before, after):
    """How far a motion goes from another for any of points (N, 3), at most; 0 for no points."""
    cdef const double[:, ::1] given = floats(points)
    cdef Motion change
    cdef double x[3]
    cdef double most = 0
    cdef Py_ssize_t k
    of_array(np.asarray(after) - np.asarray(before), change)
    with nogil:
        for k in range(given.shape[0]):
            move(change, &given[k, 0], x)
            most = fmax(most, x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    return sqrt(most)


def fit(Tree tree, samples, axes, int count, double ridge):
    """Patches of second order through the nearest points about each sample, by least squares.

    ``height(a, b) = h + s . (a, b) + c . (a^2 / 2, a b, b^2 / 2)`` over the plane of the first two
    axes, with its origin at the sample.

    Parameters
    ----------
    tree : Tree
        Of the points; at least one.
    samples : (S, 3) array
    axes : (S, 3, 3) array
        Rows, orthonormal.
    count : int
        How many neighbours, 1 to 128; all points of the tree if it has fewer.
    ridge : float
        Added to the diagonal of the equations, in units in which the patch has a radius of one and
        a point a weight of one over their number.

    Returns
    -------
    heights : (S,) array
    slopes : (S, 2) array
    bends : (S, 3) array
    reach : (S,) array
        How far the points reach along the patch.
    lopsided : (S,) array
        How far off the sample their mean is along the patch, in units of `reach`; 0 for a reach
        of 0.
    """
    cdef const double[:, ::1] given = floats(samples)
    cdef const double[:, :, ::1] frame = floats(axes)
    cdef Py_ssize_t size = given.shape[0], k
    cdef double six[6]
    cdef double guess = tree.grain * tree.grain * count
    cdef vector[Near] near
    if not 0 < count <= MOST:
        raise ValueError(f"expected 1 to {MOST} neighbours, got {count}")
    if tree.n == 0:
        raise ValueError("expected a tree of at least one point")
    if frame.shape[0] != size:
        raise ValueError(f"expected axes for each of {size} samples, got {frame.shape[0]}")
    heights, slopes, bends = np.empty(size), np.empty((size, 2)), np.empty((size, 3))
    reach, lopsided = np.empty(size), np.empty(size)
    cdef double[::1] high = heights, wide = reach, off = lopsided
    cdef double[:, ::1] slope = slopes, bend = bends
    with nogil:
        for k in range(size):
            fit_one(tree, &given[k, 0], &frame[k, 0, 0], count, ridge, &guess, near, six,
                    &wide[k], &off[k])
            high[k] = six[0]
            slope[k, 0], slope[k, 1] = six[1], six[2]
            bend[k, 0], bend[k, 1], bend[k, 2] = six[3], six[4], six[5]
    return heights, slopes, bends, reach, lopsided


cdef void gather(
    Tree tree, const double* x, double most, vector[Near]& found
) noexcept nogil:
    """All points nearer than `most` (squared), in no order."""
    cdef Py_ssize_t waiting[128]
    cdef Py_ssize_t node, i, last
    cdef int held = 1
    cdef Near one
    found.clear()
    waiting[0] = 1
    while held:
        held -= 1
        node = waiting[held]
        if not box_distance(&tree.boxes[6 * node], x) < most:
            continue
        if node < tree.leaves:
            waiting[held], waiting[held + 1] = 2 * node + 1, 2 * node
            held += 2
            continue
        i = (tree.n * (node - tree.leaves)) >> tree.depth
        last = (tree.n * (node - tree.leaves + 1)) >> tree.depth
        while i < last:
            one.first, one.second = squared_gap(tree.entries[i].x, x), i
            if one.first < most:
                found.push_back(one)
            i += 1


cdef void neighbours(
    Tree tree, const double* x, size_t count, double* guess, vector[Near]& found
) noexcept nogil:
    """The nearest points, in no order; a good guess of how far they are (squared) saves time.

    To gather all that is near, and to put what is too much aside, takes a third of the time that
    it takes to keep neighbours sorted.
    """
    cdef double most = fmax(guess[0], 1e-300), factor = 2
    gather(tree, x, most, found)
    while found.size() < count and <Py_ssize_t> found.size() < tree.n:
        most *= factor
        factor *= factor
        gather(tree, x, most, found)
    if found.size() > count:
        nth_element(found.begin(), found.begin() + (count - 1), found.end())
        guess[0] = GUESS * found[count - 1].first
        found.resize(count)
    else:
        guess[0] = most


cdef void fit_one(
    Tree tree, const double* x, const double* axes, size_t count, double ridge, double* guess,
    vector[Near]& near, double* six, double* reach, double* lopsided
) noexcept nogil:
    """The patch about one sample."""
    cdef double local[3 * MOST]
    cdef double terms[6]
    cdef double normal[36]
    cdef double gap[3]
    cdef const double* point
    cdef double most = 0, unit, a, b
    cdef int found, k, m, n
    neighbours(tree, x, count, guess, near)
    found = <int> near.size()
    for k in range(found):
        point = tree.entries[near[k].second].x
        for m in range(3):
            gap[m] = point[m] - x[m]
        for m in range(3):
            local[3 * k + m] = (axes[3 * m] * gap[0] + axes[3 * m + 1] * gap[1]
                                + axes[3 * m + 2] * gap[2])
        a, b = local[3 * k], local[3 * k + 1]
        most = fmax(most, a * a + b * b)
    reach[0] = sqrt(most)
    unit = reach[0] if most > 0 else 1.0
    for m in range(36):
        normal[m] = 0
    for m in range(6):
        six[m] = 0
    terms[0] = 1
    for k in range(found):
        a, b = local[3 * k] / unit, local[3 * k + 1] / unit
        terms[1], terms[2], terms[3], terms[4], terms[5] = a, b, a * a / 2, a * b, b * b / 2
        for m in range(6):
            six[m] += terms[m] * local[3 * k + 2]
            for n in range(m + 1):
                normal[6 * m + n] += terms[m] * terms[n]
    lopsided[0] = sqrt(normal[6] * normal[6] + normal[12] * normal[12]) / found
    for m in range(6):
        six[m] /= found
        for n in range(m + 1):
            normal[6 * m + n] /= found
        normal[7 * m] += ridge
    if not solve(normal, six, 6):
        for m in range(6):
            six[m] = 0
    for m in range(1, 3):
        six[m] /= unit
    for m in range(3, 6):
        six[m] /= unit * unit


cdef inline void turn(const double* motion, const double* x, double* turned) noexcept nogil:
    cdef int m
    for m in range(3):
        turned[m] = (motion[3 * m] * x[0] + motion[3 * m + 1] * x[1] + motion[3 * m + 2] * x[2])


cdef floats(values):
    return np.ascontiguousarray(values, dtype=np.float64)


cdef positions(values, Py_ssize_t size):
    """Positions (M,) that are safe to look up among so many."""
    found = np.ascontiguousarray(values, dtype=np.intp)
    if len(found) and not (found.min() >= 0 and found.max() < size):
        raise ValueError(f"expected positions among {size}, got {found.min()} to {found.max()}")
    return found


cdef of_vector(vector[Py_ssize_t]& values):
    found = np.empty(values.size(), dtype=np.intp)
    cdef Py_ssize_t[::1] view = found
    if values.size():
        memcpy(&view[0], values.data(), values.size() * sizeof(Py_ssize_t))
    return found


cdef void of_array(transform, double* motion) except *:
    cdef const double[:, ::1] given = floats(transform)
    cdef int i, j
    if given.shape[0] != 4 or given.shape[1] != 4:
        raise ValueError(f"expected a motion (4, 4), got {np.shape(transform)}")
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = given[i, j]
        motion[9 + i] = given[i, 3]


cdef void between(source_motion, target_motion, double* motion) except *:
    """``T_target_source``."""
    cdef Motion source, target
    cdef int i, j, m
    of_array(source_motion, source)
    of_array(target_motion, target)
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = 0
            for m in range(3):
                motion[3 * i + j] += target[3 * m + i] * source[3 * m + j]
        motion[9 + i] = 0
        for m in range(3):
            motion[9 + i] += target[3 * m + i] * (source[9 + m] - target[9 + m])
