# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Curved patches on surfaces: fitted to points, asked for distances, and summed up to equations."""

from libc.math cimport fabs, floor, fmin, sqrt
from libc.stdint cimport int64_t
from libc.string cimport memcpy
from libcpp.algorithm cimport nth_element, sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, cross, move, of_array, solve, squared_gap, turn
from mvreg.kernels.tree cimport Tree, child_distances

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
    cdef double squared, most = fmin(reach, 1e150) * fmin(reach, 1e150)
    cdef vector[Py_ssize_t] samples, patches
    cdef Py_ssize_t k, found
    cdef const Patch* here
    if stride < 1:
        raise ValueError(f"expected a stride of 1 or more, got {stride}")
    of_array(floats(transform), motion)
    with nogil:
        for k in range((source.size + stride - 1) // stride):
            here = &source.patch[stride * k]
            if here.whole:
                move(motion, here.point, x)
                squared = most
                found = target.tree.find(x, &squared)
                if found >= 0 and agree(
                    here, &target.patch[found], x, motion, flat, least_cosine, oriented
                ):
                    samples.push_back(stride * k)
                    patches.push_back(found)
    return of_vector(samples), of_vector(patches)


cdef inline bint agree(
    const Patch* here, const Patch* there, const double* x, const double* motion, bint flat,
    double least_cosine, bint oriented
) noexcept nogil:
    """Whether a sample, moved to x, lies on the patch that is nearest."""
    cdef double normal[3]
    cdef double turned[3]
    cdef double aside, cosine
    if not there.whole:
        return False
    height(there, x, flat, normal, &aside)
    if not flat and aside > there.reach * there.reach:
        return False
    turn(motion, here.normal, turned)
    cosine = turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2]
    return (cosine if oriented else fabs(cosine)) > least_cosine


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
    cdef double aside, unit = 1 / radius
    cdef double* p
    cdef double* n
    cdef int m
    if there.shape[0] != size:
        raise ValueError(f"expected a patch for each of {size} samples, got {there.shape[0]}")
    residuals, jacobian, points = np.empty(size), np.empty((size, 6)), np.empty((size, 3))
    cdef double[::1] residual = residuals
    cdef double[:, ::1] row = jacobian, point = points
    between(source_motion, target_motion, into)
    of_array(floats(target_motion), out)
    with nogil:
        for k in range(size):
            move(into, source.patch[here[k]].point, x)
            residual[k] = height(&target.patch[there[k]], x, flat, inward, &aside) * unit
            n, p = &row[k, 3], &point[k, 0]
            turn(out, inward, n)
            move(out, x, p)
            for m in range(3):
                p[m] = (p[m] - middle[m]) * unit
            cross(p, n, &row[k, 0])
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


def cell_sums(jacobian, residuals, weights, points, double width, double cut, low, double edge,
              across):
    """The gradients ``J^T W r`` of the residuals in every cell of a grid, weighted as above.

    Parameters
    ----------
    jacobian, residuals, weights, width, cut
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
    cells : (C,) array
        Numbers of the cells that have residuals, ascending.
    sums : (C, 6) array
    """
    cdef const double[:, ::1] row = floats(jacobian), point = floats(points)
    cdef const double[::1] residual = floats(residuals), weight = floats(weights)
    cdef const double[::1] start = floats(low)
    cdef const int64_t[::1] size = np.ascontiguousarray(across, dtype=np.int64)
    cdef Py_ssize_t rows_ = row.shape[0], k, found = 0
    cdef vector[pair[int64_t, Py_ssize_t]] order
    cdef double square, share
    cdef int64_t key
    cdef int m
    if not row.shape[1] == 6 or not rows_ == residual.shape[0] == weight.shape[0] == point.shape[0]:
        raise ValueError(f"expected (M, 6), (M,), (M,), (M, 3), got {np.shape(jacobian)}, "
                         f"{np.shape(residuals)}, {np.shape(weights)}, {np.shape(points)}")
    with nogil:
        order.resize(rows_)
        for k in range(rows_):
            key = 0
            for m in range(3):
                key = key * size[m] + <int64_t> floor((point[k, m] - start[m]) / edge)
            order[k].first, order[k].second = key, k
        sort(order.begin(), order.end())
        for k in range(rows_):
            if k == 0 or order[k].first != order[k - 1].first:
                found += 1
    cells, sums = np.empty(found, dtype=np.int64), np.zeros((found, 6))
    cdef int64_t[::1] cell = cells
    cdef double[:, ::1] sum_ = sums
    cdef Py_ssize_t place = -1, one
    with nogil:
        for k in range(rows_):
            one = order[k].second
            if k == 0 or order[k].first != order[k - 1].first:
                place += 1
                cell[place] = order[k].first
            square = (residual[one] / width) * (residual[one] / width)
            if square < cut * cut:
                share = weight[one] * residual[one] / ((1 + square) * (1 + square))
                for m in range(6):
                    sum_[place, m] += share * row[one, m]
    return cells, sums


def farthest(points, before, after):
    """How far a motion goes from another for any of points (N, 3), at most; 0 for no points."""
    cdef const double[:, ::1] given = floats(points)
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
        near.resize(tree.n + 1)
        for k in range(size):
            fit_one(tree, &given[k, 0], &frame[k, 0, 0], count, ridge, &guess, near.data(), six,
                    &wide[k], &off[k])
            high[k] = six[0]
            slope[k, 0], slope[k, 1] = six[1], six[2]
            bend[k, 0], bend[k, 1], bend[k, 2] = six[3], six[4], six[5]
    return heights, slopes, bends, reach, lopsided


def distances(Tree tree, Py_ssize_t rank):
    """How far each point's neighbour of a rank is, in the tree itself.

    Parameters
    ----------
    tree : Tree
    rank : int
        At least 1, and less than there are points; the point itself has the rank 0.

    Returns
    -------
    (N,) array
    """
    cdef double guess = tree.grain * tree.grain * rank
    cdef vector[Near] near
    cdef Py_ssize_t k
    if not 0 < rank < tree.n:
        raise ValueError(f"expected a rank of 1 to {tree.n - 1}, got {rank}")
    found = np.empty(tree.n)
    cdef double[::1] far = found
    with nogil:
        near.resize(tree.n + 1)
        for k in range(tree.n):  # in the tree's order: the last one was near, the guess is good
            neighbours(tree, tree.entries[k].x, rank + 1, &guess, near.data())
            far[tree.entries[k].index] = sqrt(near[rank].first)
    return found


cdef Py_ssize_t gather(Tree tree, const double* x, double most, Near* found) noexcept nogil:
    """All points nearer than `most` (squared), in no order; how many. There is room for all."""
    cdef Py_ssize_t waiting[128]
    cdef double apart[2]
    cdef Py_ssize_t node, i, last, size = 0
    cdef int held = 1
    waiting[0] = 1
    while held:
        held -= 1
        node = waiting[held]
        while node < tree.leaves:
            child_distances(tree.boxes, node, x, apart)
            node *= 2
            if apart[0] < most:
                waiting[held] = node + 1
                held += apart[1] < most
            else:
                node += 1
                if not apart[1] < most:
                    break
        else:
            i = (tree.n * (node - tree.leaves)) >> tree.depth
            last = (tree.n * (node - tree.leaves + 1)) >> tree.depth
            while i < last:
                found[size].first = squared_gap(tree.entries[i].x, x)
                found[size].second = i
                size += found[size].first < most
                i += 1
    return size


cdef Py_ssize_t neighbours(
    Tree tree, const double* x, Py_ssize_t count, double* guess, Near* found
) noexcept nogil:
    """The nearest points, the last of them in its place; how many.

    A good guess of how far they are saves time.

    To gather all that is near, and to put aside what is too much, takes half the time that it takes
    to keep neighbours sorted.
    """
    cdef double most = guess[0], factor = 2
    cdef Py_ssize_t size = gather(tree, x, most, found)
    while size < count and size < tree.n:
        most = (most if most > 1e-300 else 1e-300) * factor
        factor *= factor
        size = gather(tree, x, most, found)
    if size >= count:
        nth_element(found, found + (count - 1), found + size)
        guess[0] = GUESS * found[count - 1].first
        return count
    guess[0] = most
    return size


cdef void fit_one(
    Tree tree, const double* x, const double* axes, Py_ssize_t count, double ridge, double* guess,
    Near* near, double* six, double* reach, double* lopsided
) noexcept nogil:
    """The patch about one sample."""
    cdef double local[3 * MOST]
    cdef double normal[36]
    cdef double gap[3]
    # Sums of a^p b^q, and of their products with the height.
    cdef double a, b, h, aa, ab, bb
    cdef double s10 = 0, s01 = 0, s20 = 0, s11 = 0, s02 = 0, s30 = 0, s21 = 0, s12 = 0, s03 = 0
    cdef double s40 = 0, s31 = 0, s22 = 0, s13 = 0, s04 = 0
    cdef double h00 = 0, h10 = 0, h01 = 0, h20 = 0, h11 = 0, h02 = 0
    cdef const double* point
    cdef double most = 0, unit, per
    cdef Py_ssize_t found = neighbours(tree, x, count, guess, near), k
    cdef int m
    for k in range(found):
        point = tree.entries[near[k].second].x
        for m in range(3):
            gap[m] = point[m] - x[m]
        for m in range(3):
            local[3 * k + m] = (axes[3 * m] * gap[0] + axes[3 * m + 1] * gap[1]
                                + axes[3 * m + 2] * gap[2])
        aa = local[3 * k] * local[3 * k] + local[3 * k + 1] * local[3 * k + 1]
        most = aa if aa > most else most
    reach[0] = sqrt(most)
    unit = reach[0] if most > 0 else 1.0
    per = 1 / unit
    for k in range(found):
        a, b, h = local[3 * k] * per, local[3 * k + 1] * per, local[3 * k + 2]
        aa, ab, bb = a * a, a * b, b * b
        s10, s01, s20, s11, s02 = s10 + a, s01 + b, s20 + aa, s11 + ab, s02 + bb
        s30, s21, s12, s03 = s30 + aa * a, s21 + aa * b, s12 + a * bb, s03 + b * bb
        s40, s31, s22 = s40 + aa * aa, s31 + aa * ab, s22 + aa * bb
        s13, s04 = s13 + ab * bb, s04 + bb * bb
        h00, h10, h01 = h00 + h, h10 + a * h, h01 + b * h
        h20, h11, h02 = h20 + aa * h, h11 + ab * h, h02 + bb * h
    # The terms are 1, a, b, a^2 / 2, a b, b^2 / 2; the lower triangle is all that is asked for.
    normal[0] = found
    normal[6], normal[7] = s10, s20
    normal[12], normal[13], normal[14] = s01, s11, s02
    normal[18], normal[19], normal[20], normal[21] = s20 / 2, s30 / 2, s21 / 2, s40 / 4
    normal[24], normal[25], normal[26], normal[27], normal[28] = s11, s21, s12, s31 / 2, s22
    normal[30], normal[31], normal[32] = s02 / 2, s12 / 2, s03 / 2
    normal[33], normal[34], normal[35] = s22 / 4, s13 / 2, s04 / 4
    six[0], six[1], six[2], six[3], six[4], six[5] = h00, h10, h01, h20 / 2, h11, h02 / 2
    lopsided[0] = sqrt(s10 * s10 + s01 * s01) / found
    for m in range(6):
        normal[7 * m] += ridge * found
    if not solve(normal, six, 6):
        for m in range(6):
            six[m] = 0
    for m in range(1, 3):
        six[m] /= unit
    for m in range(3, 6):
        six[m] /= unit * unit


cdef floats(values):
    return np.ascontiguousarray(values, dtype=np.float64)


cdef positions(values, Py_ssize_t size):
    """Positions (M,) that are safe to look up among so many."""
    found = np.ascontiguousarray(values, dtype=np.intp)
    cdef const Py_ssize_t[::1] view = found
    cdef Py_ssize_t k
    for k in range(view.shape[0]):
        if not 0 <= view[k] < size:
            raise ValueError(f"expected positions among {size}, got {view[k]}")
    return found


cdef of_vector(vector[Py_ssize_t]& values):
    found = np.empty(values.size(), dtype=np.intp)
    cdef Py_ssize_t[::1] view = found
    if values.size():
        memcpy(&view[0], values.data(), values.size() * sizeof(Py_ssize_t))
    return found


cdef void between(source_motion, target_motion, double* motion) except *:
    """``T_target_source``."""
    cdef Motion source, target
    cdef int i, j, m
    of_array(floats(source_motion), source)
    of_array(floats(target_motion), target)
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = 0
            for m in range(3):
                motion[3 * i + j] += target[3 * m + i] * source[3 * m + j]
        motion[9 + i] = 0
        for m in range(3):
            motion[9 + i] += target[3 * m + i] * (source[9 + m] - target[9 + m])
