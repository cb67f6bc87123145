# cython: language_level=3
"""What the other kernels need of the k-d tree."""

from mvreg.kernels.simd cimport WIDE

cdef struct Entry:
    double x[3]
    Py_ssize_t index


cdef class Tree:
    cdef readonly object data
    cdef readonly Py_ssize_t n
    cdef readonly object mins
    cdef readonly object maxes
    cdef Entry* entries
    # Of siblings side by side: their lowest x, y, z, then their highest, in pairs.
    cdef double* boxes
    cdef const double[:, ::1] cloud
    cdef Py_ssize_t leaves
    cdef int depth
    cdef readonly double grain
    cdef Py_ssize_t find(self, const double* x, double* squared) noexcept nogil
    cdef Py_ssize_t find_two(self, const double* x, double* first, double* second) noexcept nogil
    cdef int find_many(self, const double* x, int k, double* squared, Py_ssize_t* which) noexcept nogil


cdef extern from *:
    """
    // The SSE2 path of child_distances: two numbers at a time. What it computes is what
    // node_distance computes, bit for bit.
    #if MVREG_WIDE
    static inline void wide_distances(const double* pair, const double* x, double* apart) {
        __m128d total = _mm_setzero_pd();
        for (int axis = 0; axis < 3; axis++) {
            const __m128d at = _mm_set1_pd(x[axis]);
            __m128d gap = _mm_max_pd(_mm_sub_pd(_mm_loadu_pd(pair + 2 * axis), at),
                                     _mm_sub_pd(at, _mm_loadu_pd(pair + 6 + 2 * axis)));
            gap = _mm_max_pd(gap, _mm_setzero_pd());
            total = _mm_add_pd(total, _mm_mul_pd(gap, gap));
        }
        _mm_storeu_pd(apart, total);
    }
    #else
    static inline void wide_distances(const double*, const double*, double*) {}
    #endif
    """
    void wide_distances(const double* pair, const double* x, double* apart) noexcept nogil


cdef inline double node_distance(const double* boxes, Py_ssize_t node, const double* x) noexcept nogil:
    """Squared distance of a point from the box of a node."""
    cdef const double* box = &boxes[12 * (node >> 1) + (node & 1)]
    cdef double total = 0, gap, other
    cdef int axis
    for axis in range(3):
        gap = box[2 * axis] - x[axis]
        other = x[axis] - box[6 + 2 * axis]
        gap = gap if gap > other else other
        gap = gap if gap > 0 else 0
        total += gap * gap
    return total


cdef inline void child_distances(
    const double* boxes, Py_ssize_t node, const double* x, double* apart
) noexcept nogil:
    """Squared distances of a point from the boxes of a node's two children."""
    if WIDE:
        wide_distances(&boxes[12 * node], x, apart)
    else:
        apart[0] = node_distance(boxes, 2 * node, x)
        apart[1] = node_distance(boxes, 2 * node + 1, x)
