# cython: language_level=3
"""What the iterations of ICP need of the trimmed pairs."""

from libc.stdint cimport uint64_t
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.helper cimport Helper
from mvreg.kernels.tree cimport Tree

# The bits of a distance, and whose it is.
ctypedef pair[uint64_t, Py_ssize_t] Ranked


cdef class Pairing:
    cdef Tree tree
    cdef const double[:, ::1] points
    cdef const double[:, ::1] target
    cdef Py_ssize_t size, first, kept
    cdef double bound, objective, fine
    cdef vector[double] moved, asked, others, distance, weight
    cdef vector[Py_ssize_t] partner, order
    cdef vector[Ranked] ranked, spare
    cdef Helper* helper
    cdef bint pair(self, const double* motion) noexcept nogil
    cdef void ask_for_help(self)
    cdef void look_between(self, Py_ssize_t start, Py_ssize_t stop) noexcept nogil
    cdef void look(self, Py_ssize_t i) noexcept nogil
    cdef void rank(self) noexcept nogil
    cdef void trim(self) noexcept nogil
    cdef double last(self) noexcept nogil
    cdef void narrow(self, double least) noexcept nogil
    cdef void fit(self, double* motion) noexcept nogil
    cdef answer(self)


cdef int check_paired(bint paired) except -1
