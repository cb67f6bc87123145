# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""The rigid motions that most matches agree with (RANSAC)."""

from libc.math cimport fabs, sqrt
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport (
    Motion, copy, cross, kabsch, move, norm, outer_sum, squared_gap, to_array,
)

from mvreg.kernels.simd cimport WIDE

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks


cdef extern from *:
    """
    // How many matches a motion brings closer than a squared limit; none if they cannot be more
    // than so many. All x of the one side come first, then all y, all z, then those of the other.
    MVREG_CLONES static Py_ssize_t hits(
        const double* motion, const double* at, Py_ssize_t size, double limit, Py_ssize_t most
    ) {
        Py_ssize_t found = 0, i = 0;
        while (i < size) {
            const Py_ssize_t last = i + 64 < size ? i + 64 : size;
            long long some = 0;
            for (; i < last; i++) {
                const double x = at[i], y = at[size + i], z = at[2 * size + i];
                const double u = motion[0] * x + motion[1] * y + motion[2] * z + motion[9]
                    - at[3 * size + i];
                const double v = motion[3] * x + motion[4] * y + motion[5] * z + motion[10]
                    - at[4 * size + i];
                const double w = motion[6] * x + motion[7] * y + motion[8] * z + motion[11]
                    - at[5 * size + i];
                some += u * u + v * v + w * w < limit;
            }
            found += some;
            if (found + size - i <= most)
                return 0;
        }
        return found;
    }
    """
    Py_ssize_t hits(
        const double* motion, const double* at, Py_ssize_t size, double limit, Py_ssize_t most
    ) noexcept nogil


def consensus(source, target, matches, ends, draws, double tolerance):
    """The rigid motions with the largest consensus sets, of samples of three matches (RANSAC).

    Fischler and Bolles 1981. A sample whose triangles differ in their sides is no rigid motion and
    is passed over; inliers are counted, and the best sample's are fitted anew (Kabsch).

    Parameters
    ----------
    source, target : (K, 3) arrays
        Keypoints.
    matches : (M, 2) array
        Positions: source, target; several sets of matches, one after the other.
    ends : (S + 1,) array
        Where each set begins, and ends.
    draws : (S, R, 3) array
        For each set the positions in it of three different matches, R times.
    tolerance : float
        A match agrees if the motion brings it closer than this (length).

    Returns
    -------
    poses : (S, 4, 4) array
        ``T_target_source``, fitted to the agreeing matches of each set.
    agree : (M,) array of bool
        Which they are; none, and no pose, where no sample has more than three.
    """
    cdef const double[:, ::1] here = checks.floats("source", source, "K", 3)
    cdef const double[:, ::1] there = checks.floats("target", target, "K", 3)
    cdef const Py_ssize_t[:, ::1] pairs = checks.index_pairs(
        "matches", matches, here.shape[0], there.shape[0])
    parts = checks.ends("ends", ends, pairs.shape[0])
    cdef const Py_ssize_t[::1] end = parts
    cdef const Py_ssize_t[:, :, ::1] drawn = positions_in_sets(draws, np.diff(parts))
    cdef Py_ssize_t sets = end.shape[0] - 1, s
    poses, agree = np.zeros((sets, 4, 4)), np.zeros(pairs.shape[0], dtype=bool)
    cdef double[:, :, ::1] pose = poses
    cdef unsigned char[::1] kept = agree.view(np.uint8)
    poses[:, 3, 3] = 1
    with nogil:
        for s in range(sets):
            agreed(here, there, pairs[end[s]:end[s + 1]], drawn[s], tolerance, pose[s],
                   kept[end[s]:end[s + 1]])
    return poses, agree


cdef positions_in_sets(draws, sizes):
    """Draws (S, R, 3) that are safe to look up: each among the matches of its own set."""
    found = checks.integers("draws", draws, len(sizes), "R", 3)
    cdef const Py_ssize_t[:, :, ::1] drawn = found
    cdef const Py_ssize_t[::1] size = sizes
    cdef Py_ssize_t s, i
    cdef int k
    for s in range(drawn.shape[0]):
        for i in range(drawn.shape[1]):
            for k in range(3):
                if not 0 <= drawn[s, i, k] < size[s]:
                    raise InputError(
                        f"draws: expected positions among the {size[s]} matches of set {s}, got "
                        f"{drawn[s, i, k]}")
    return found


cdef void agreed(
    const double[:, ::1] here, const double[:, ::1] there, const Py_ssize_t[:, ::1] pairs,
    const Py_ssize_t[:, ::1] drawn, double tolerance, double[:, ::1] pose, unsigned char[::1] kept
) noexcept nogil:
    """The consensus of one set of matches."""
    cdef Py_ssize_t size = pairs.shape[0], s, i, most = 3, votes, j
    cdef vector[double] x, y, apart
    cdef double a[9]
    cdef double b[9]
    cdef double limit = tolerance * tolerance
    cdef Motion motion
    cdef Motion best = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    cdef int k
    x.resize(3 * size)
    y.resize(3 * size)
    apart.resize(6 * size)
    for i in range(size):
        for k in range(3):
            x[3 * i + k], y[3 * i + k] = here[pairs[i, 0], k], there[pairs[i, 1], k]
            apart[k * size + i], apart[(3 + k) * size + i] = x[3 * i + k], y[3 * i + k]
    for s in range(drawn.shape[0]):
        for j in range(3):
            for k in range(3):
                a[3 * j + k], b[3 * j + k] = x[3 * drawn[s, j] + k], y[3 * drawn[s, j] + k]
        if not sound(a, b, tolerance):
            continue
        triangle(a, b, motion)
        votes = hits(motion, apart.data(), size, limit, most)
        if votes > most:
            most = votes
            copy(motion, best)
    if most == 3:
        return
    for i in range(size):
        kept[i] = squared_miss(best, &x[3 * i], &y[3 * i]) < limit
    fit(x, y, kept, most, motion)
    to_array(motion, pose)


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
    return norm(n) > tolerance * tolerance


cdef void normal_of(const double* a, double* n) noexcept nogil:
    """Across a triangle, twice its area long."""
    cdef double u[3]
    cdef double v[3]
    cdef int k
    for k in range(3):
        u[k], v[k] = a[3 + k] - a[k], a[6 + k] - a[k]
    cross(u, v, n)


cdef void frame_of(const double* a, double* mean, double* axes) noexcept nogil:
    """Two axes along a triangle of some size and one across it (rows), and its middle."""
    cdef double length
    cdef int k
    for k in range(3):
        mean[k] = (a[k] + a[3 + k] + a[6 + k]) / 3
        axes[k] = a[3 + k] - a[k]
    length = norm(axes)
    for k in range(3):
        axes[k] /= length
    normal_of(a, &axes[6])
    length = norm(&axes[6])
    for k in range(3):
        axes[6 + k] /= length
    cross(&axes[6], axes, &axes[3])


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
    cdef int i, k
    for k in range(3):
        mean_a[k] = (a[k] + a[3 + k] + a[6 + k]) / 3
        mean_b[k] = (b[k] + b[3 + k] + b[6 + k]) / 3
    for k in range(9):
        h[k] = 0
    for i in range(3):
        outer_sum(h, &a[3 * i], mean_a, &b[3 * i], mean_b)
    kabsch(h, mean_a, mean_b, motion)


cdef void fit(
    const vector[double]& x, const vector[double]& y, const unsigned char[::1] kept,
    Py_ssize_t size, double* motion
) noexcept nogil:
    """The motion that fits the matches kept, of which there are `size`, best."""
    cdef double h[9]
    cdef double mean_x[3]
    cdef double mean_y[3]
    cdef Py_ssize_t i
    cdef int k
    for k in range(3):
        mean_x[k], mean_y[k] = 0, 0
    for i in range(kept.shape[0]):
        if kept[i]:
            for k in range(3):
                mean_x[k] += x[3 * i + k] / size
                mean_y[k] += y[3 * i + k] / size
    for k in range(9):
        h[k] = 0
    for i in range(kept.shape[0]):
        if kept[i]:
            outer_sum(h, &x[3 * i], mean_x, &y[3 * i], mean_y)
    kabsch(h, mean_x, mean_y, motion)
