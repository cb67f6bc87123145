# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Spread seed matches over two shapes, and find the motion that most of the matches agree with."""

from libc.math cimport INFINITY, M_PI as PI, fabs, fabsf, sqrt
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport (
    Motion, cross, kabsch, move, norm, squared_gap, to_array,
)

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks


# Rings in a tolerance; what is farther than so many rings shares the last one.
cdef enum:
    RINGS = 2
    MOST_RINGS = 65536

cdef extern from *:
    """
    // Four numbers at a time. What it finds is what most_alike finds, of all but the last few.
    #ifdef __SSE2__
    #include <emmintrin.h>
    #define MVREG_WIDE 1
    static inline Py_ssize_t wide_alike(
        const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
        Py_ssize_t scales, float limit, Py_ssize_t count, float* least, Py_ssize_t* best
    ) {
        const __m128 size = _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff));
        const __m128 middle = _mm_set1_ps(at), one = _mm_set1_ps(1), most = _mm_set1_ps(limit);
        Py_ssize_t n = 0;
        for (; n + 4 <= count; n += 4) {
            __m128 near = _mm_and_ps(_mm_sub_ps(_mm_loadu_ps(away + n), middle), size);
            __m128 fits = _mm_cmple_ps(near, one), cost = _mm_setzero_ps();
            for (Py_ssize_t scale = 0; scale < scales; scale++) {
                const __m128 angle = _mm_loadu_ps(angles + scale * stride + n);
                const __m128 apart = _mm_sub_ps(angle, _mm_set1_ps(wanted[scale]));
                const __m128 turned = _mm_and_ps(apart, size);
                fits = _mm_and_ps(fits, _mm_cmplt_ps(turned, most));
                cost = _mm_add_ps(cost, turned);
            }
            int any = _mm_movemask_ps(fits);
            if (any) {
                float costs[4];
                _mm_storeu_ps(costs, cost);
                for (int k = 0; k < 4; k++)
                    if (any >> k & 1 && costs[k] < *least) {
                        *least = costs[k];
                        *best = n + k;
                    }
            }
        }
        return n;
    }
    #else
    #define MVREG_WIDE 0
    static inline Py_ssize_t wide_alike(
        const float*, float, const float*, Py_ssize_t, const float*, Py_ssize_t, float, Py_ssize_t,
        float*, Py_ssize_t*
    ) { return 0; }
    #endif
    """
    const bint WIDE "MVREG_WIDE"
    Py_ssize_t wide_alike(
        const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
        Py_ssize_t scales, float limit, Py_ssize_t count, float* least, Py_ssize_t* best
    ) noexcept nogil


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

    def __cinit__(self, keypoints, normals, descriptors):
        self.keypoints = checks.floats("keypoints", keypoints, "K", 3, finite=True)
        size = self.keypoints.shape[0]
        self.normals = checks.floats("normals", normals, size, "L", 3, finite=True)
        self.descriptors = checks.floats("descriptors", descriptors, size, "D")
        if not self.normals.shape[1]:
            raise InputError("normals: expected one scale or more, got none")
        self.size, self.scales = self.normals.shape[0], self.normals.shape[1]
        self.length = self.descriptors.shape[1]


cdef class About:
    """A shape as one of its keypoints sees it, in rings of half a tolerance each.

    `away` are distances in tolerances, `angle` those to the seed's normals, scale by scale; both
    ring by ring. Ring r ends where ``ends[r + 1]`` says.
    """

    cdef vector[Py_ssize_t] which, ends, next
    cdef vector[float] away, angle, far

    cdef void look(
        self, Shape shape, Py_ssize_t seed, bint oriented, double tolerance
    ) noexcept nogil:
        """Sort into rings; find the angles."""
        cdef Py_ssize_t k, place, ring, scale, size = shape.size, rings = 0
        self.far.resize(size)
        self.which.resize(size)
        self.away.resize(size)
        self.angle.resize(size * shape.scales)
        for k in range(size):
            self.far[k] = <float> (
                sqrt(squared_gap(&shape.keypoints[k, 0], &shape.keypoints[seed, 0])) / tolerance)
            rings = max(rings, ring_of(self.far[k]) + 1)
        self.ends.assign(rings + 1, 0)
        for k in range(size):
            self.ends[ring_of(self.far[k]) + 1] += 1
        for ring in range(rings):
            self.ends[ring + 1] += self.ends[ring]
        self.next = self.ends
        for k in range(size):
            ring = ring_of(self.far[k])
            place = self.next[ring]
            self.next[ring] += 1
            self.which[place], self.away[place] = k, self.far[k]
            for scale in range(shape.scales):
                self.angle[scale * size + place] = turn(shape, k, seed, scale, oriented)


cdef inline Py_ssize_t ring_of(float away) noexcept nogil:
    """The ring of a distance in tolerances, whatever it is."""
    cdef float ring = RINGS * away
    return <Py_ssize_t> ring if ring < MOST_RINGS else MOST_RINGS


cdef inline float turn(
    Shape shape, Py_ssize_t k, Py_ssize_t seed, Py_ssize_t scale, bint oriented
) noexcept nogil:
    """The angle between the normals of two keypoints at a scale."""
    cdef const double* a = &shape.normals[k, scale, 0]
    cdef const double* b = &shape.normals[seed, scale, 0]
    return <float> arc(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], oriented)


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
    Shape source not None, Shape target not None, seeds, bint oriented, double distance_tolerance,
    double angle_tolerance, double descriptor_tolerance, Py_ssize_t step
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
    step : int
        Every so many-th keypoint of the target is asked.

    Returns
    -------
    matches : (M, 2) array
        Those of all seeds, one after the other; each seed is the first of its own.
    ends : (S + 1,) array
        Where the matches of each seed begin, and end.
    """
    cdef const Py_ssize_t[:, ::1] given = pairs_among("seeds", seeds, source.size, target.size)
    cdef About own = About()
    cdef vector[Py_ssize_t] matches
    cdef Py_ssize_t s, size = given.shape[0]
    ends = np.zeros(size + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] end = ends
    if source.scales != target.scales or source.length != target.length:
        raise ValueError("expected normals and descriptors of the same kind")
    checks.positive(distance_tolerance=distance_tolerance)
    if step < 1:
        raise InputError(f"step: expected 1 or more, got {step}")
    step = min(step, max(target.size, 1))
    with nogil:
        for s in range(size):
            own.look(source, given[s, 0], oriented, distance_tolerance)
            matches.push_back(given[s, 0])
            matches.push_back(given[s, 1])
            match(source, target, own, given[s, 1], oriented, distance_tolerance, angle_tolerance,
                  descriptor_tolerance, step, matches)
            end[s + 1] = matches.size() // 2
    found = np.empty((end[size], 2), dtype=np.intp)
    cdef Py_ssize_t[:, ::1] out = found
    for s in range(end[size]):
        out[s, 0], out[s, 1] = matches[2 * s], matches[2 * s + 1]
    return found, ends


cdef pairs_among(name, values, Py_ssize_t source, Py_ssize_t target):
    """Positions (M, 2) that are safe to look up: among the source's and the target's."""
    found = checks.integers(name, values, "M", 2)
    for column, size in enumerate((source, target)):
        checks.indices(f"{name}[:, {column}]", found[:, column], size)
    return found


cdef void match(
    Shape source, Shape target, About own, Py_ssize_t seed, bint oriented,
    double distance_tolerance, float limit, double descriptor_tolerance, Py_ssize_t step,
    vector[Py_ssize_t]& matches
) noexcept nogil:
    """Add the matches of one seed, in the order of the target's keypoints."""
    cdef Py_ssize_t scales = source.scales, size = source.size, m, n, best, scale, k, ring
    cdef Py_ssize_t rings = own.ends.size() - 1, low, count
    cdef double total, gap
    cdef float away
    cdef vector[float] wanted
    cdef vector[Py_ssize_t] partner, left
    partner.resize(target.size, -1)
    left.resize(size + 1)
    wanted.resize(scales)
    m = -step
    while m + step < target.size:
        m += step
        away = <float> (sqrt(squared_gap(&target.keypoints[m, 0], &target.keypoints[seed, 0]))
                        / distance_tolerance)
        ring = ring_of(away)
        if m == seed or ring - RINGS >= rings:
            continue
        for scale in range(scales):
            wanted[scale] = turn(target, m, seed, scale, oriented)
        low = own.ends[max(ring - RINGS, 0)]
        count = own.ends[min(ring + RINGS + 1, rings)] - low
        best = most_alike(&own.away[low], away, &own.angle[low], size, wanted.data(), scales, limit,
                          count, left.data())
        if best >= 0:
            partner[m] = own.which[low + best]
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


cdef inline Py_ssize_t most_alike(
    const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
    Py_ssize_t scales, float limit, Py_ssize_t count, Py_ssize_t* left
) noexcept nogil:
    """Which is as far away to within one, and turned as much at all scales, most nearly; or -1."""
    cdef float least = INFINITY, cost, one
    cdef Py_ssize_t best = -1, done = 0, found = 0, n, k, scale
    if WIDE:
        done = wide_alike(
            away, at, angles, stride, wanted, scales, limit, count, &least, &best)
    for n in range(done, count):  # most are ruled out here, without a branch
        left[found] = n
        found += (fabsf(away[n] - at) <= 1) & (fabsf(angles[n] - wanted[0]) < limit)
    for k in range(found):
        cost = 0
        for scale in range(scales):
            one = fabsf(angles[scale * stride + left[k]] - wanted[scale])
            cost += one
            if one >= limit:
                cost = INFINITY
                break
        if cost < least:
            least, best = cost, left[k]
    return best


cdef class Rows:
    """Rows (N, D), N at least 1, in the order of the column that varies most.

    Parameters
    ----------
    rows : (N, D) array
    """

    cdef Py_ssize_t axis
    cdef const Py_ssize_t[::1] ranked
    cdef const double[:, ::1] ascending

    def __cinit__(self, rows):
        given = checks.floats("rows", rows, "N", "D", finite=True)
        if not given.size:
            raise InputError(f"rows: expected one or more, of one number or more, got {given.shape}")
        self.axis = given.var(axis=0).argmax()
        order = np.argsort(given[:, self.axis], kind="stable")
        self.ranked, self.ascending = order, given[order]

    def nearest(self, queries):
        """The nearest row to each of queries (M, D).

        Along the column that varies most: once that gap alone is too wide the search is over.

        Returns
        -------
        distances, indices : (M,) arrays
            The first of those equally near.
        """
        cdef const double[:, ::1] asked = checks.floats(
            "queries", queries, "M", self.ascending.shape[1], finite=True)
        cdef const double[:, ::1] ascending = self.ascending
        cdef Py_ssize_t size = ascending.shape[0], length = ascending.shape[1], axis = self.axis
        cdef Py_ssize_t i, j, k, best, up, down
        cdef double least, total, gap
        distances, indices = np.empty(asked.shape[0]), np.empty(asked.shape[0], dtype=np.intp)
        cdef double[::1] far = distances
        cdef Py_ssize_t[::1] which = indices
        cdef const Py_ssize_t[::1] start = np.searchsorted(
            np.asarray(ascending)[:, axis], np.asarray(asked)[:, axis])
        with nogil:
            for i in range(asked.shape[0]):
                least, best, up, down = INFINITY, -1, start[i], start[i] - 1
                while up < size or down >= 0:
                    if up < size and (down < 0 or ascending[up, axis] - asked[i, axis]
                                      <= asked[i, axis] - ascending[down, axis]):
                        j = up
                        up += 1
                    else:
                        j = down
                        down -= 1
                    gap = ascending[j, axis] - asked[i, axis]
                    if gap * gap > least:
                        break
                    total, k = 0, 0
                    while k < length and total <= least:
                        gap = asked[i, k] - ascending[j, k]
                        total += gap * gap
                        k += 1
                    if total < least or (total == least and (best < 0 or self.ranked[j] < best)):
                        least, best = total, self.ranked[j]
                far[i], which[i] = sqrt(least), best
        return distances, indices


def consensus(source, target, matches, ends, draws, double tolerance):
    """The rigid motions that most matches agree with, of those of samples of three (RANSAC).

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
    cdef const Py_ssize_t[:, ::1] pairs = pairs_among(
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
    wrong = (found < 0) | (found >= sizes[:, None, None])
    if wrong.any():
        s, *_ = np.argwhere(wrong)[0]
        raise InputError(
            f"draws: expected positions among the {sizes[s]} matches of set {s}, got "
            f"{found[wrong][0]}")
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
        votes = hits(motion, apart.data(), size, limit)
        if votes > most:
            most = votes
            for k in range(12):
                best[k] = motion[k]
    if most == 3:
        return
    for i in range(size):
        kept[i] = squared_miss(best, &x[3 * i], &y[3 * i]) < limit
    fit(x, y, kept, most, motion)
    to_array(motion, pose)


cdef inline Py_ssize_t hits(
    const double* motion, const double* at, Py_ssize_t size, double limit
) noexcept nogil:
    """How many matches a motion brings closer than a squared limit.

    All x of the one side come first, then all y, all z, then those of the other. Counted in
    floating point, so that compilers take several at a time.
    """
    cdef Py_ssize_t i
    cdef double u, v, w, found = 0
    for i in range(size):
        u = (motion[0] * at[i] + motion[1] * at[size + i] + motion[2] * at[2 * size + i]
             + motion[9] - at[3 * size + i])
        v = (motion[3] * at[i] + motion[4] * at[size + i] + motion[5] * at[2 * size + i]
             + motion[10] - at[4 * size + i])
        w = (motion[6] * at[i] + motion[7] * at[size + i] + motion[8] * at[2 * size + i]
             + motion[11] - at[5 * size + i])
        found += 1.0 if u * u + v * v + w * w < limit else 0.0
    return <Py_ssize_t> found


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
    const vector[double]& x, const vector[double]& y, const unsigned char[::1] kept,
    Py_ssize_t size, double* motion
) noexcept nogil:
    """The motion that fits the matches kept, of which there are `size`, best."""
    cdef double h[9]
    cdef double mean_x[3]
    cdef double mean_y[3]
    cdef Py_ssize_t i
    cdef int j, k
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
            for j in range(3):
                for k in range(3):
                    h[3 * j + k] += (x[3 * i + j] - mean_x[j]) * (y[3 * i + k] - mean_y[k])
    kabsch(h, mean_x, mean_y, motion)
