# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Curved patches, fitted to the points about samples."""

from libc.math cimport INFINITY, fmax, sqrt
from libc.string cimport memset
from libcpp.algorithm cimport nth_element
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport solve, squared_gap
from mvreg.kernels.tree cimport Tree, child_distances

import numpy as np

from mvreg.kernels import checks
from mvreg.kernels.results import FittedPatches

cdef enum:
    MOST = 128  # neighbours of a sample
    BINS = 64  # of squared distances: on a surface as many points in each

# A point of a tree: how far it is (squared), and its place among the tree's entries.
ctypedef pair[double, Py_ssize_t] Near
# The sample that a point belongs to, and how far it is from it along its axes (squared).
cdef struct Owner:
    double apart
    Py_ssize_t sample
# Points that may be neighbours, with room for as many again, and the bins of their distances.
cdef struct Found:
    Near* near
    Near* spare
    unsigned char* bins
# As much farther than the last one's are the next sample's neighbours looked for (squared).
cdef double GUESS = 1.4


def fit(Tree tree not None, samples, axes, int count, double ridge):
    """Patches of second order through the nearest points about each sample, by least squares.

    ``height(a, b) = h + s . (a, b) + c . (a^2 / 2, a b, b^2 / 2)`` over the first two axes, with
    its origin at the sample. Besides, every point that any patch rests on belongs to the cell of
    one sample: the one that it is nearest to along that sample's first two axes.

    Parameters
    ----------
    tree : Tree
        Of the points; at least one.
    samples : (S, 3) array
    axes : (S, 3, 3) array
        Rows: what coordinates along them are, as products with them.
    count : int
        How many neighbours, 1 to 128; all points of the tree if it has fewer.
    ridge : float
        Added to the diagonal of the equations, in units in which the patch has a radius of one and
        a point a weight of one over their number.

    Returns
    -------
    FittedPatches
    """
    cdef const double[:, ::1] given = checks.floats("samples", samples, "S", 3, finite=True)
    cdef const double[:, :, ::1] frame = checks.floats("axes", axes, "S", 3, 3)
    cdef Py_ssize_t size = given.shape[0], k
    cdef double six[6]
    cdef double guess = tree.grain * tree.grain * count
    cdef vector[Near] near, spare
    cdef vector[unsigned char] bins
    cdef Found found
    cdef vector[Owner] owners
    if not 0 < count <= MOST:
        raise ValueError(f"expected 1 to {MOST} neighbours, got {count}")
    if tree.n == 0:
        raise ValueError("expected a tree of at least one point")
    if frame.shape[0] != size:
        raise ValueError(f"expected axes for each of {size} samples, got {frame.shape[0]}")
    heights, slopes, bends = np.empty(size), np.empty((size, 2)), np.empty((size, 3))
    reach, lopsided, radius, variance = (np.empty(size) for _ in range(4))
    cdef double[::1] high = heights, wide = reach, off = lopsided, far = radius, rough = variance
    cdef double[:, ::1] slope = slopes, bend = bends
    counts, means, seconds = np.zeros(size), np.zeros((size, 3)), np.zeros((size, 3, 3))
    cdef double[::1] many = counts
    cdef double[:, ::1] mean = means
    cdef double[:, :, ::1] second = seconds
    with nogil:
        near.resize(tree.n + 1)
        spare.resize(tree.n + 1)
        bins.resize(tree.n + 1)
        found.near, found.spare, found.bins = near.data(), spare.data(), bins.data()
        owners.resize(tree.n)
        for k in range(tree.n):
            owners[k].apart, owners[k].sample = INFINITY, -1
        for k in range(size):
            fit_one(tree, &given[k, 0], &frame[k, 0, 0], k, count, ridge, &guess, &found,
                    owners.data(), six, &wide[k], &off[k], &far[k], &rough[k])
            high[k] = six[0]
            slope[k, 0], slope[k, 1] = six[1], six[2]
            bend[k, 0], bend[k, 1], bend[k, 2] = six[3], six[4], six[5]
        if size:
            gather_cells(tree, owners.data(), &given[0, 0], size, &many[0], &mean[0, 0],
                         &second[0, 0, 0])
    return FittedPatches(
        heights, slopes, bends, reach, lopsided, radius, variance, counts, means, seconds)


cdef void gather_cells(
    Tree tree, const Owner* owners, const double* samples, Py_ssize_t size, double* counts,
    double* means, double* seconds
) noexcept nogil:
    """How many points each sample's cell has, their mean, and their covariance."""
    cdef double gap[3]
    cdef double* mean
    cdef double* second
    cdef Py_ssize_t k, one
    cdef int i, j
    for k in range(tree.n):
        one = owners[k].sample
        if one >= 0:
            counts[one] += 1
            for i in range(3):  # from the sample: large coordinates leave sums their digits
                means[3 * one + i] += tree.entries[k].x[i] - samples[3 * one + i]
    for k in range(3 * size):
        means[k] = samples[k] + (means[k] / counts[k // 3] if counts[k // 3] > 0 else 0.0)
    for k in range(tree.n):
        one = owners[k].sample
        if one < 0:
            continue
        mean, second = means + 3 * one, seconds + 9 * one
        for i in range(3):
            gap[i] = tree.entries[k].x[i] - mean[i]
        for i in range(3):
            for j in range(3):
                second[3 * i + j] += gap[i] * gap[j]
    for k in range(9 * size):
        seconds[k] /= fmax(counts[k // 9], 1)


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


cdef double nearest_of(
    const Found* found, Py_ssize_t size, Py_ssize_t count, double most
) noexcept nogil:
    """Bring the nearest `count` of `size` points to the front; how far the last is (squared).

    Counted by bins of their distance, all below `most`; the bin in which the last is is divided. No
    branch depends on a distance: to divide all of them by pivots takes five times as long.
    """
    cdef Py_ssize_t sizes[BINS]
    cdef double scale = BINS / most
    cdef Py_ssize_t k, before = 0, kept = 0, aside = 0
    cdef Near one
    cdef int last = 0, m
    memset(sizes, 0, sizeof(sizes))
    for k in range(size):
        m = <int> (found.near[k].first * scale)
        m = m if m < BINS - 1 else BINS - 1
        found.bins[k] = m
        sizes[m] += 1
    while before + sizes[last] < count:
        before += sizes[last]
        last += 1
    for k in range(size):
        one = found.near[k]
        found.near[kept] = found.spare[aside] = one
        kept += found.bins[k] < last
        aside += found.bins[k] == last
    nth_element(found.spare, found.spare + (count - before - 1), found.spare + aside)
    for k in range(count - before):
        found.near[kept + k] = found.spare[k]
    return found.spare[count - before - 1].first


cdef Py_ssize_t neighbours(
    Tree tree, const double* x, Py_ssize_t count, double* guess, const Found* found
) noexcept nogil:
    """The nearest points, in no order; how many.

    A good guess of how far they are saves time. Points whose squared distance overflows are none.

    To gather all that is near, and to put aside what is too much, takes half the time that it takes
    to keep neighbours sorted.
    """
    cdef double most = guess[0], factor = 2
    cdef Py_ssize_t size = gather(tree, x, most, found.near)
    while size < count and size < tree.n and most < INFINITY:
        most = (most if most > 1e-300 else 1e-300) * factor
        factor *= factor
        size = gather(tree, x, most, found.near)
    if size >= count:
        guess[0] = GUESS * nearest_of(found, size, count, most)
        return count
    guess[0] = most
    return size


cdef void fit_one(
    Tree tree, const double* x, const double* axes, Py_ssize_t sample, Py_ssize_t count,
    double ridge, double* guess, const Found* near_, Owner* owners, double* six, double* reach,
    double* lopsided, double* radius, double* variance
) noexcept nogil:
    """The patch about one sample, and what it rests on of its cell."""
    cdef double local[3 * MOST]
    cdef double normal[36]
    cdef double gap[3]
    # Sums of a^p b^q, and of their products with the height.
    cdef double a, b, h, aa, ab, bb
    cdef double s10 = 0, s01 = 0, s20 = 0, s11 = 0, s02 = 0, s30 = 0, s21 = 0, s12 = 0, s03 = 0
    cdef double s40 = 0, s31 = 0, s22 = 0, s13 = 0, s04 = 0
    cdef double h00 = 0, h10 = 0, h01 = 0, h20 = 0, h11 = 0, h02 = 0, left = 0
    cdef const double* point
    cdef double most = 0, farthest = 0, unit, per
    cdef Py_ssize_t found = neighbours(tree, x, count, guess, near_), k
    cdef const Near* near = near_.near
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
        farthest = near[k].first if near[k].first > farthest else farthest
        if aa < owners[near[k].second].apart:
            owners[near[k].second].apart, owners[near[k].second].sample = aa, sample
    reach[0], radius[0] = sqrt(most), sqrt(farthest)
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
    # What is left of the heights: a second look at the points, for differences of sums lose digits.
    for k in range(found):
        a, b = local[3 * k] * per, local[3 * k + 1] * per
        h = local[3 * k + 2] - (six[0] + six[1] * a + six[2] * b + six[3] * (a * a / 2)
                                + six[4] * (a * b) + six[5] * (b * b / 2))
        left += h * h
    variance[0] = left / fmax(found - 6, 1)
    for m in range(1, 3):
        six[m] /= unit
    for m in range(3, 6):
        six[m] /= unit * unit
