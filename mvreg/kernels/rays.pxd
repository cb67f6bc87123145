# cython: language_level=3
"""What the evidence of two scans needs of the rays."""

from libcpp.vector cimport vector

# Rays that answer for a point, at most.
cdef enum:
    MOST_RAYS = 64

cdef struct Ray:
    double x[3]  # where it is across the others
    double height


cdef class Rays:
    cdef vector[Ray] rays
    cdef vector[Py_ssize_t] first
    cdef double frame[9]
    cdef double origin[3]
    cdef double least[2]
    cdef double most[2]
    cdef double low[2]
    cdef double high[2]
    cdef Py_ssize_t size[2]
    cdef Py_ssize_t rings
    cdef double distance, reach, edge
    cdef bint central
    cdef void aim(self, const double[:, ::1] points, Py_ssize_t count) noexcept nogil
    cdef void project(self, const double* x, Ray* ray) noexcept nogil
    cdef void span(self) noexcept nogil
    cdef Py_ssize_t divide(self, double edge) noexcept nogil
    cdef void arrange(self) noexcept nogil
    cdef int ask(
        self, const double* x, int most, double reach, Ray* one, Ray* top, double* low
    ) noexcept nogil
    cdef double off_plane(
        self, const Ray* one, const Ray* other, const double* normal
    ) noexcept nogil
    cdef bint beside(self, const double* x, double radius) noexcept nogil


cdef int check_rays(int most) except -1
