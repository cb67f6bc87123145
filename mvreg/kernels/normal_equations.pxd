# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
"""Normal equations of six unknowns, summed up row by row."""

from libc.string cimport memset

# The lower triangle of ``J^T W J``, and ``J^T W r``.
cdef struct Sums:
    double normal[36]
    double gradient[6]


cdef inline void clear(Sums* sums) noexcept nogil:
    memset(sums, 0, sizeof(Sums))


cdef inline void add_row(
    Sums* sums, const double* row, double weight, double residual
) noexcept nogil:
    cdef double slope
    cdef int m, n
    for m in range(6):
        slope = weight * row[m]
        sums.gradient[m] += slope * residual
        for n in range(m + 1):
            sums.normal[6 * m + n] += slope * row[n]


cdef inline void write(const Sums* sums, double* normal, double* gradient) noexcept nogil:
    """Write the whole of both."""
    cdef int m, n
    for m in range(6):
        gradient[m] = sums.gradient[m]
        for n in range(m + 1):
            normal[6 * m + n] = normal[6 * n + m] = sums.normal[6 * m + n]
