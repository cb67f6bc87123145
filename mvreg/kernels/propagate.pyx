# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Spread seed matches over two shapes, and find the motion that most of the matches agree with."""

from libc.math cimport INFINITY, M_PI as PI, fabs, sqrt
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, kabsch, move, squared_gap

import numpy as np


cdef class Shape:
    """The keypoints of one view as `Spread` asks for them.

    Parameters
    ----------
    keypoints : (K, 3) array
    normals : (K, L, 3) array
        Unit, one per scale.
    descriptors : (K, D) array
    """

    cdef const double[:, ::1] keypoints
    cdef const double[:, :, ::1] normals
    cdef const double[:, ::1] descriptors
    cdef Py_ssize_t size, scales, length

    def __init__(self, keypoints, normals, descriptors):
        self.keypoints = np.ascontiguousarray(keypoints, dtype=np.float64)
        self.normals = np.ascontiguousarray(normals, dtype=np.float64)
        self.descriptors = np.ascontiguousarray(descriptors, dtype=np.float64)
        self.size, self.scales = self.normals.shape[0], self.normals.shape[1]
        self.length = self.descriptors.shape[1]


cdef class About:
    """A shape as one of its keypoints sees it, the nearest keypoint first."""

    cdef vector[pair[double, Py_ssize_t]] ranked
    cdef vector[double] angle

    cdef void look(self, Shape shape, Py_ssize_t seed, bint oriented) noexcept nogil:
        """Sort by distance; find the angles to the seed's normals, scale by scale."""
        cdef Py_ssize_t k, n, scale, size = shape.size
        cdef const double* a
        cdef const double* b
        cdef double* out
        self.ranked.resize(size)
        self.angle.resize(size * shape.scales)
        for k in range(size):
            self.ranked[k].first = sqrt(
                squared_gap(&shape.keypoints[k, 0], &shape.keypoints[seed, 0]))
            self.ranked[k].second = k
        sort(self.ranked.begin(), self.ranked.end())
        for k in range(size):
            n = self.ranked[k].second
            for scale in range(shape.scales):
                a, b = &shape.normals[n, scale, 0], &shape.normals[seed, scale, 0]
                self.angle[scale * size + k] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        out = self.angle.data()
        for k in range(size * shape.scales):
            out[k] = arc(out[k], oriented)


cdef inline double arc(double cosine, bint oriented) noexcept nogil:
    """The angle of a cosine, to 2e-8 radians (Abramowitz and Stegun 4.4.46): no call, no branch."""
    cdef double x = fabs(cosine)
    cdef double angle
    x = x if x < 1 else 1
    angle = sqrt(1 - x) * (1.5707963050 + x * (-0.2145988016 + x * (0.0889789874 + x * (
        -0.0501743046 + x * (0.0308918810 + x * (-0.0170881256 + x * (
            0.0066700901 - x * 0.0012624911)))))))
    return PI - angle if oriented and cosine < 0 else angle


def spread(
    Shape source, Shape target, seeds, bint oriented, double distance_tolerance,
    double angle_tolerance, double descriptor_tolerance
):
    """Spread every seed over both shapes.

    A keypoint of the target is matched with that of the source which is as far from its seed, to
    within a tolerance, whose normals turn as much from the seed's at all scales, on average most
    nearly so; the match counts if the descriptors agree (Sec. 3.2 of the paper).

    Parameters
    ----------
    source, target : Shape
    seeds : (S, 2) array
        Positions of keypoints: source, target.
    oriented : bool
        Whether the signs of the normals mean something.
    distance_tolerance, descriptor_tolerance : float
        A length; a distance of descriptors.
    angle_tolerance : float
        Radians, under a right angle.

    Returns
    -------
    list of (M, 2) arrays
        Matches for each seed, itself first.
    """
    cdef const Py_ssize_t[:, ::1] given = np.ascontiguousarray(seeds, dtype=np.intp)
    cdef About own = About(), other = About()
    cdef vector[Py_ssize_t] matches
    cdef Py_ssize_t[:, ::1] out
    cdef Py_ssize_t s, m
    if source.scales != target.scales or source.length != target.length:
        raise ValueError("expected normals and descriptors of the same kind")
    found = []
    for s in range(given.shape[0]):
        with nogil:
            own.look(source, given[s, 0], oriented)
            other.look(target, given[s, 1], oriented)
            matches.clear()
            matches.push_back(given[s, 0])
            matches.push_back(given[s, 1])
            match(source, target, own, other, given[s, 1], distance_tolerance, angle_tolerance,
                  descriptor_tolerance, matches)
        one = np.empty((matches.size() // 2, 2), dtype=np.intp)
        out = one
        for m in range(out.shape[0]):
            out[m, 0], out[m, 1] = matches[2 * m], matches[2 * m + 1]
        found.append(one)
    return found


cdef void match(
    Shape source, Shape target, About own, About other, Py_ssize_t seed, double distance_tolerance,
    double limit, double descriptor_tolerance, vector[Py_ssize_t]& matches
) noexcept nogil:
    """Add the matches of one seed, in the order of the target's keypoints."""
    cdef Py_ssize_t scales = source.scales, size = source.size, m, n, best, scale, low = 0, k
    cdef double away, cost, least, total, gap
    cdef const double* alpha = own.angle.data()
    cdef const double* theta = other.angle.data()
    cdef vector[Py_ssize_t] partner
    partner.resize(target.size, -1)
    for m in range(target.size):  # farther and farther: the band slides along
        away = other.ranked[m].first
        if other.ranked[m].second == seed:
            continue
        while low < size and own.ranked[low].first < away - distance_tolerance:
            low += 1
        best, least = -1, INFINITY
        n = low
        while n < size and own.ranked[n].first <= away + distance_tolerance:
            cost = 0
            for scale in range(scales):  # the first scales empty the band
                gap = fabs(alpha[scale * size + n] - theta[scale * target.size + m])
                if gap >= limit:
                    cost = INFINITY
                    break
                cost += gap
            if cost < least:
                least, best = cost, n
            n += 1
        if best >= 0:
            partner[other.ranked[m].second] = own.ranked[best].second
    for m in range(target.size):
        k = partner[m]
        if k < 0:
            continue
        total = 0
        for n in range(source.length):
            gap = source.descriptors[k, n] - target.descriptors[m, n]
            total += gap * gap
        if sqrt(total) < descriptor_tolerance:
            matches.push_back(k)
            matches.push_back(m)


def consensus(source, target, matches, draws, double tolerance):
    """The rigid motion that most matches agree with, of those of samples of three (RANSAC).

    Parameters
    ----------
    source, target : (K, 3) arrays
        Keypoints.
    matches : (M, 2) array
        Positions: source, target.
    draws : (S, 3) array
        Positions of three different matches each.
    tolerance : float
        A match agrees if the motion brings it closer than this (length).

    Returns
    -------
    (T_target_source, agreeing) or None
        The motion (4, 4) fitted to the agreeing matches, and their positions; None when no sample
        has more than three.
    """
    cdef const double[:, ::1] here = np.ascontiguousarray(source, dtype=np.float64)
    cdef const double[:, ::1] there = np.ascontiguousarray(target, dtype=np.float64)
    cdef const Py_ssize_t[:, ::1] pairs = np.ascontiguousarray(matches, dtype=np.intp)
    cdef const Py_ssize_t[:, ::1] drawn = np.ascontiguousarray(draws, dtype=np.intp)
    cdef Py_ssize_t size = pairs.shape[0], s, i, votes, most = 3, j
    cdef vector[double] x, y
    cdef double a[9]
    cdef double b[9]
    cdef double limit = tolerance * tolerance
    cdef Motion motion
    cdef Motion best = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    cdef int k
    with nogil:
        x.resize(3 * size)
        y.resize(3 * size)
        for i in range(size):
            for k in range(3):
                x[3 * i + k], y[3 * i + k] = here[pairs[i, 0], k], there[pairs[i, 1], k]
        for s in range(drawn.shape[0]):
            for j in range(3):
                for k in range(3):
                    a[3 * j + k], b[3 * j + k] = x[3 * drawn[s, j] + k], y[3 * drawn[s, j] + k]
            if not sound(a, b, tolerance):
                continue
            triangle(a, b, motion)
            votes = 0
            for i in range(size):
                votes += squared_miss(motion, &x[3 * i], &y[3 * i]) < limit
            if votes > most:
                most = votes
                for k in range(12):
                    best[k] = motion[k]
    if most == 3:
        return None
    agreeing = np.empty(most, dtype=np.intp)
    cdef Py_ssize_t[::1] kept = agreeing
    j = 0
    for i in range(size):
        if squared_miss(best, &x[3 * i], &y[3 * i]) < limit:
            kept[j] = i
            j += 1
    fit(x, y, kept, motion)
    transform = np.eye(4)
    cdef double[:, ::1] out = transform
    for j in range(3):
        for k in range(3):
            out[j, k] = motion[3 * j + k]
        out[j, 3] = motion[9 + j]
    return transform, agreeing


cdef inline double squared_miss(const double* motion, const double* x, const double* y) noexcept nogil:
    cdef double moved[3]
    move(motion, x, moved)
    return squared_gap(moved, y)


cdef bint sound(const double* a, const double* b, double tolerance) noexcept nogil:
    """Whether three points make a triangle of some size that keeps its shape."""
    cdef double here[3]
    cdef double n[3]
    cdef int i, j
    for i in range(3):
        j = (i + 1) % 3
        if fabs(sqrt(squared_gap(&a[3 * i], &a[3 * j]))
                - sqrt(squared_gap(&b[3 * i], &b[3 * j]))) >= 2 * tolerance:
            return False
    normal_of(a, n)
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) > tolerance * tolerance


cdef void normal_of(const double* a, double* n) noexcept nogil:
    """Across a triangle, twice its area long."""
    cdef double u[3]
    cdef double v[3]
    cdef int k
    for k in range(3):
        u[k], v[k] = a[3 + k] - a[k], a[6 + k] - a[k]
    n[0], n[1], n[2] = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                        u[0] * v[1] - u[1] * v[0])


cdef void frame_of(const double* a, double* mean, double* axes) noexcept nogil:
    """Two axes along a triangle of some size and one across it (rows), and its middle."""
    cdef double length
    cdef int k
    for k in range(3):
        mean[k] = (a[k] + a[3 + k] + a[6 + k]) / 3
        axes[k] = a[3 + k] - a[k]
    length = sqrt(axes[0] * axes[0] + axes[1] * axes[1] + axes[2] * axes[2])
    for k in range(3):
        axes[k] /= length
    normal_of(a, &axes[6])
    length = sqrt(axes[6] * axes[6] + axes[7] * axes[7] + axes[8] * axes[8])
    for k in range(3):
        axes[6 + k] /= length
    axes[3] = axes[7] * axes[2] - axes[8] * axes[1]
    axes[4] = axes[8] * axes[0] - axes[6] * axes[2]
    axes[5] = axes[6] * axes[1] - axes[7] * axes[0]


cdef void triangle(const double* a, const double* b, double* motion) noexcept nogil:
    """The motion that fits three points to three others best (Kabsch), in closed form.

    The best rotation takes plane to plane. Within it, it is the rotation or the reflection that
    the 2x2 sums of products ask for most; a reflection is half a turn about an axis in the plane.
    """
    cdef double mean_a[3]
    cdef double mean_b[3]
    cdef double p[9]
    cdef double q[9]
    cdef double h[4]
    cdef double u[2]
    cdef double v[2]
    cdef double turn_c, turn_s, flip_c, flip_s, turning, flipping, c, s, sign
    cdef int i, j, k
    if not flat_enough(b):
        general(a, b, motion)
        return
    frame_of(a, mean_a, p)
    frame_of(b, mean_b, q)
    for k in range(4):
        h[k] = 0
    for i in range(3):
        for j in range(2):
            u[j], v[j] = 0, 0
            for k in range(3):
                u[j] += (a[3 * i + k] - mean_a[k]) * p[3 * j + k]
                v[j] += (b[3 * i + k] - mean_b[k]) * q[3 * j + k]
        for j in range(2):
            for k in range(2):
                h[2 * j + k] += v[j] * u[k]
    turn_c, turn_s = h[0] + h[3], h[2] - h[1]
    flip_c, flip_s = h[0] - h[3], h[2] + h[1]
    turning = sqrt(turn_c * turn_c + turn_s * turn_s)
    flipping = sqrt(flip_c * flip_c + flip_s * flip_s)
    # In the frames: x' = c x - sign s y, y' = s x + sign c y, z' = sign z.
    if turning >= flipping:
        c, s, sign = turn_c / turning, turn_s / turning, 1
    else:
        c, s, sign = flip_c / flipping, flip_s / flipping, -1
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = (
                q[i] * (c * p[j] - sign * s * p[3 + j])
                + q[3 + i] * (s * p[j] + sign * c * p[3 + j])
                + sign * q[6 + i] * p[6 + j])
    for i in range(3):
        motion[9 + i] = mean_b[i] - (motion[3 * i] * mean_a[0] + motion[3 * i + 1] * mean_a[1]
                                     + motion[3 * i + 2] * mean_a[2])


cdef bint flat_enough(const double* b) noexcept nogil:
    """Whether a triangle is wide enough to have a normal."""
    cdef double n[3]
    cdef double side = squared_gap(b, &b[3]) + squared_gap(b, &b[6])
    normal_of(b, n)
    return n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 1e-12 * side * side and squared_gap(b, &b[3]) > 0


cdef void general(const double* a, const double* b, double* motion) noexcept nogil:
    """The same for any three points."""
    cdef double h[9]
    cdef double mean_a[3]
    cdef double mean_b[3]
    cdef int i, j, k
    for k in range(3):
        mean_a[k] = (a[k] + a[3 + k] + a[6 + k]) / 3
        mean_b[k] = (b[k] + b[3 + k] + b[6 + k]) / 3
    for k in range(9):
        h[k] = 0
    for i in range(3):
        for j in range(3):
            for k in range(3):
                h[3 * j + k] += (a[3 * i + j] - mean_a[j]) * (b[3 * i + k] - mean_b[k])
    kabsch(h, mean_a, mean_b, motion)


cdef void fit(
    const vector[double]& x, const vector[double]& y, const Py_ssize_t[::1] kept, double* motion
) noexcept nogil:
    """The motion that fits the matches kept best."""
    cdef double h[9]
    cdef double mean_x[3]
    cdef double mean_y[3]
    cdef Py_ssize_t i, size = kept.shape[0]
    cdef int j, k
    for k in range(3):
        mean_x[k], mean_y[k] = 0, 0
        for i in range(size):
            mean_x[k] += x[3 * kept[i] + k] / size
            mean_y[k] += y[3 * kept[i] + k] / size
    for k in range(9):
        h[k] = 0
    for i in range(size):
        for j in range(3):
            for k in range(3):
                h[3 * j + k] += (x[3 * kept[i] + j] - mean_x[j]) * (y[3 * kept[i] + k] - mean_y[k])
    kabsch(h, mean_x, mean_y, motion)
