# cython: language_level=3
"""What the iterations of ICP need of the Anderson acceleration."""

from mvreg.kernels.linear cimport Motion
from mvreg.kernels.trimmed_pairs cimport Pairing

# Poses that it remembers (5 in the authors' code).
cdef enum:
    MEMORY = 6


cdef class Acceleration:
    cdef double at[MEMORY][6]
    cdef double to[MEMORY][6]
    cdef Motion base
    cdef double centre[3]
    cdef double radius
    cdef int held
    cdef Pairing pairing
    cdef void forget(self) noexcept nogil
    cdef void begin(self, const double* motion) noexcept nogil
    cdef void coordinates(self, const double* motion, double* six) noexcept nogil
    cdef void motion_at(self, const double* six, double* motion) noexcept nogil
    cdef bint leap(self, double* motion, const double* plain) noexcept nogil
