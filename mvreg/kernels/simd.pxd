# cython: language_level=3
"""Whether kernels take their SSE2 paths: on every x86-64; elsewhere plain C, with the same answers."""

cdef extern from *:
    """
    #ifndef MVREG_WIDE
    #if defined(__SSE2__) || defined(_M_X64)
    #include <emmintrin.h>
    #define MVREG_WIDE 1
    #else
    #define MVREG_WIDE 0
    #endif
    #endif
    """
    const bint WIDE "MVREG_WIDE"
