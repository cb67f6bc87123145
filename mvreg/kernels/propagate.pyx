# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Spread seed matches over two shapes (Sec. 3.2 of the paper)."""

from libc.math cimport INFINITY, M_PI as PI, fabs, fabsf, sqrt
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport dot, squared_gap
from mvreg.kernels.simd cimport WIDE

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks


# Rings in a tolerance; what is farther than so many rings shares the last one.
cdef enum:
    RINGS = 2
    MOST_RINGS = 65536

cdef extern from *:
    """
    // The SSE2 path of most_alike: four numbers at a time. What it finds is what that finds, bit for
    // bit, of all but the last few.
    #if MVREG_WIDE
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
    static inline Py_ssize_t wide_alike(
        const float*, float, const float*, Py_ssize_t, const float*, Py_ssize_t, float, Py_ssize_t,
        float*, Py_ssize_t*
    ) { return 0; }
    #endif
    """
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
    return <float> arc(dot(a, b), oriented)


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
    cdef const Py_ssize_t[:, ::1] given = checks.index_pairs("seeds", seeds, source.size, target.size)
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
    """Which is as far away to within one, and turned as much at all scales, most nearly; or -1.

    By SSE2 (`wide_alike`) where the machine has it, and the last few, or all, in plain C.
    """
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
