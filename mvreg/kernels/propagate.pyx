# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Spread seed matches over two shapes (Sec. 3.2 of the paper)."""

from libc.math cimport INFINITY, fabsf, sqrt
from libcpp.vector cimport vector

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
    #include <math.h>
    // How far points are from another, in tolerances. All x come first, then all y, all z.
    MVREG_CLONES static void distances_from(
        const double* at, Py_ssize_t count, const double* centre, double tolerance, float* far
    ) {
        for (Py_ssize_t i = 0; i < count; i++) {
            const double x = at[i] - centre[0], y = at[count + i] - centre[1];
            const double z = at[2 * count + i] - centre[2];
            far[i] = (float) (sqrt(x * x + y * y + z * z) / tolerance);
        }
    }

    // The angles of unit vectors to another, to 2e-8 radians (Abramowitz and Stegun 4.4.46): no
    // call, no branch.
    MVREG_CLONES static void angles_to(
        const double* of, Py_ssize_t count, const double* other, int oriented, float* angle
    ) {
        for (Py_ssize_t i = 0; i < count; i++) {
            const double cosine = of[i] * other[0] + of[count + i] * other[1]
                + of[2 * count + i] * other[2];
            const double size = fabs(cosine), x = size < 1 ? size : 1;
            const double arc = sqrt(1 - x) * (1.5707963050 + x * (-0.2145988016
                + x * (0.0889789874 + x * (-0.0501743046 + x * (0.0308918810
                + x * (-0.0170881256 + x * (0.0066700901 - x * 0.0012624911)))))));
            angle[i] = (float) (oriented && cosine < 0 ? 3.14159265358979323846 - arc : arc);
        }
    }

    // The wide paths of most_alike: eight and four numbers at a time. What they find is what that
    // finds, bit for bit, of all but the last few.
    #if MVREG_WIDE
    // Each lane keeps its own least, the first of equals; then the least of the lanes is taken, and
    // of equals again the first.
    static inline void least_of(
        const float* costs, const int* places, int lanes, float* least, Py_ssize_t* best
    ) {
        for (int k = 0; k < lanes; k++)
            if (costs[k] < *least || (costs[k] == *least && places[k] < *best)) {
                *least = costs[k];
                *best = places[k];
            }
    }

    static inline Py_ssize_t four_alike(
        const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
        Py_ssize_t scales, float limit, Py_ssize_t n, Py_ssize_t count, float* least,
        Py_ssize_t* best
    ) {
        const __m128 size = _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff));
        const __m128 middle = _mm_set1_ps(at), one = _mm_set1_ps(1), most = _mm_set1_ps(limit);
        __m128 lowest = _mm_set1_ps(*least);
        __m128i place = _mm_add_epi32(_mm_set1_epi32((int) n), _mm_setr_epi32(0, 1, 2, 3));
        __m128i first = _mm_set1_epi32((int) *best);
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
            fits = _mm_and_ps(fits, _mm_cmplt_ps(cost, lowest));
            const __m128i better = _mm_castps_si128(fits);
            lowest = _mm_or_ps(_mm_and_ps(fits, cost), _mm_andnot_ps(fits, lowest));
            first = _mm_or_si128(_mm_and_si128(better, place), _mm_andnot_si128(better, first));
            place = _mm_add_epi32(place, _mm_set1_epi32(4));
        }
        float costs[4];
        int places[4];
        _mm_storeu_ps(costs, lowest);
        _mm_storeu_si128((__m128i*) places, first);
        least_of(costs, places, 4, least, best);
        return n;
    }
    #endif
    #if MVREG_WIDER
    __attribute__((target("avx2"))) static Py_ssize_t eight_alike(
        const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
        Py_ssize_t scales, float limit, Py_ssize_t count, float* least, Py_ssize_t* best
    ) {
        const __m256 size = _mm256_castsi256_ps(_mm256_set1_epi32(0x7fffffff));
        const __m256 middle = _mm256_set1_ps(at), one = _mm256_set1_ps(1);
        const __m256 most = _mm256_set1_ps(limit);
        __m256 lowest = _mm256_set1_ps(*least);
        __m256i place = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        __m256i first = _mm256_set1_epi32((int) *best);
        Py_ssize_t n = 0;
        for (; n + 8 <= count; n += 8) {
            __m256 near = _mm256_and_ps(_mm256_sub_ps(_mm256_loadu_ps(away + n), middle), size);
            __m256 fits = _mm256_cmp_ps(near, one, _CMP_LE_OS), cost = _mm256_setzero_ps();
            for (Py_ssize_t scale = 0; scale < scales; scale++) {
                const __m256 angle = _mm256_loadu_ps(angles + scale * stride + n);
                const __m256 apart = _mm256_sub_ps(angle, _mm256_set1_ps(wanted[scale]));
                const __m256 turned = _mm256_and_ps(apart, size);
                fits = _mm256_and_ps(fits, _mm256_cmp_ps(turned, most, _CMP_LT_OS));
                cost = _mm256_add_ps(cost, turned);
            }
            fits = _mm256_and_ps(fits, _mm256_cmp_ps(cost, lowest, _CMP_LT_OS));
            lowest = _mm256_blendv_ps(lowest, cost, fits);
            first = _mm256_blendv_epi8(first, place, _mm256_castps_si256(fits));
            place = _mm256_add_epi32(place, _mm256_set1_epi32(8));
        }
        float costs[8];
        int places[8];
        _mm256_storeu_ps(costs, lowest);
        _mm256_storeu_si256((__m256i*) places, first);
        least_of(costs, places, 8, least, best);
        return n;
    }
    static const int MVREG_EIGHT = (__builtin_cpu_init(), __builtin_cpu_supports("avx2") != 0);
    #endif

    static inline Py_ssize_t wide_alike(
        const float* away, float at, const float* angles, Py_ssize_t stride, const float* wanted,
        Py_ssize_t scales, float limit, Py_ssize_t count, float* least, Py_ssize_t* best
    ) {
        Py_ssize_t done = 0;
    #if MVREG_WIDER
        if (MVREG_EIGHT)
            done = eight_alike(
                away, at, angles, stride, wanted, scales, limit, count, least, best);
    #endif
    #if MVREG_WIDE
        done = four_alike(
            away, at, angles, stride, wanted, scales, limit, done, count, least, best);
    #endif
        return done;
    }
    """
    void distances_from(
        const double* at, Py_ssize_t count, const double* centre, double tolerance, float* far
    ) noexcept nogil
    void angles_to(
        const double* of, Py_ssize_t count, const double* other, int oriented, float* angle
    ) noexcept nogil
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
    """Every so many-th keypoint of a shape as one of all its keypoints sees them.

    `far` are distances in tolerances, `angle` those to the seed's normals, scale by scale. Sorted
    into rings of half a tolerance each they are `away` and `turned`, of the keypoints `which`; ring
    r ends where ``ends[r + 1]`` says.
    """

    cdef vector[double] places, normals
    cdef vector[float] far, angle, away, turned
    cdef vector[Py_ssize_t] which, ends, next
    cdef Py_ssize_t size, scales

    cdef void take(self, Shape shape, Py_ssize_t step) noexcept nogil:
        """Copy what is asked of the shape."""
        cdef Py_ssize_t i, scale
        cdef int k
        self.size, self.scales = (shape.size + step - 1) // step, shape.scales
        self.places.resize(3 * self.size)
        self.normals.resize(3 * self.size * self.scales)
        self.far.resize(self.size)
        self.angle.resize(self.size * self.scales)
        for k in range(3):
            for i in range(self.size):
                self.places[k * self.size + i] = shape.keypoints[step * i, k]
            for scale in range(self.scales):
                for i in range(self.size):
                    self.normals[(3 * scale + k) * self.size + i] = (
                        shape.normals[step * i, scale, k])

    cdef void look(
        self, Shape shape, Py_ssize_t seed, bint oriented, double tolerance
    ) noexcept nogil:
        """Find distances and angles."""
        cdef Py_ssize_t scale
        distances_from(
            self.places.data(), self.size, &shape.keypoints[seed, 0], tolerance, self.far.data())
        for scale in range(self.scales):
            angles_to(
                self.normals.data() + 3 * scale * self.size, self.size,
                &shape.normals[seed, scale, 0], oriented, self.angle.data() + scale * self.size)

    cdef void sort(self) noexcept nogil:
        """Sort what was found into rings."""
        cdef Py_ssize_t k, place, ring, scale, size = self.size, rings = 0
        self.which.resize(size)
        self.away.resize(size)
        self.turned.resize(size * self.scales)
        for k in range(size):
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
            for scale in range(self.scales):
                self.turned[scale * size + place] = self.angle[scale * size + k]


cdef inline Py_ssize_t ring_of(float away) noexcept nogil:
    """The ring of a distance in tolerances, whatever it is."""
    cdef float ring = RINGS * away
    return <Py_ssize_t> ring if ring < MOST_RINGS else MOST_RINGS


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
    cdef About here = About(), there = About()
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
        here.take(source, 1)
        there.take(target, step)
        for s in range(size):
            here.look(source, given[s, 0], oriented, distance_tolerance)
            there.look(target, given[s, 1], oriented, distance_tolerance)
            here.sort()
            matches.push_back(given[s, 0])
            matches.push_back(given[s, 1])
            match(source, target, here, there, given[s, 1], angle_tolerance, descriptor_tolerance,
                  step, matches)
            end[s + 1] = matches.size() // 2
    found = np.empty((end[size], 2), dtype=np.intp)
    cdef Py_ssize_t[:, ::1] out = found
    for s in range(end[size]):
        out[s, 0], out[s, 1] = matches[2 * s], matches[2 * s + 1]
    return found, ends


cdef void match(
    Shape source, Shape target, About own, About there, Py_ssize_t seed, float limit,
    double descriptor_tolerance, Py_ssize_t step, vector[Py_ssize_t]& matches
) noexcept nogil:
    """Add the matches of one seed, in the order of the target's keypoints."""
    cdef Py_ssize_t scales = source.scales, size = source.size, i, m, n, best, scale, k, ring
    cdef Py_ssize_t rings = own.ends.size() - 1, low, count
    cdef double total, gap
    cdef vector[float] wanted
    cdef vector[Py_ssize_t] partner, left
    partner.resize(there.size, -1)
    left.resize(size + 1)
    wanted.resize(scales)
    for i in range(there.size):
        ring = ring_of(there.far[i])
        if step * i == seed or ring - RINGS >= rings:
            continue
        for scale in range(scales):
            wanted[scale] = there.angle[scale * there.size + i]
        low = own.ends[max(ring - RINGS, 0)]
        count = own.ends[min(ring + RINGS + 1, rings)] - low
        best = most_alike(&own.away[low], there.far[i], &own.turned[low], size, wanted.data(),
                          scales, limit, count, left.data())
        if best >= 0:
            partner[i] = own.which[low + best]
    for i in range(there.size):
        k, m = partner[i], step * i
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

    Several at a time (`wide_alike`) where the machine can, and the last few, or all, in plain C.
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
