# cython: language_level=3
"""What the other kernels need of the k-d tree."""

cdef struct Entry:
    double x[3]
    Py_ssize_t index


cdef class Tree:
    cdef readonly object data
    cdef readonly Py_ssize_t n
    cdef readonly object mins
    cdef readonly object maxes
    cdef Entry* entries
    cdef double* boxes
    cdef const double[:, ::1] cloud
    cdef Py_ssize_t leaves
    cdef int depth
    cdef readonly double grain
    cdef Py_ssize_t find(self, const double* x, double* squared) noexcept nogil
    cdef Py_ssize_t find_two(self, const double* x, double* first, double* second) noexcept nogil
    cdef int find_many(self, const double* x, int k, double* squared, Py_ssize_t* which) noexcept nogil


cdef inline double box_distance(const double* box, const double* x) noexcept nogil:
    """Squared distance of a point from a box (low, high: six numbers)."""
    cdef double total = 0, gap
    cdef int axis
    for axis in range(3):
        gap = box[axis] - x[axis]
        if gap < x[axis] - box[3 + axis]:
            gap = x[axis] - box[3 + axis]
        if gap > 0:
            total += gap * gap
    return total
