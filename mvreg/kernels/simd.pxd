# cython: language_level=3
"""Which instructions kernels use: SSE2 on every x86-64, AVX2 where the processor has it.

Elsewhere plain C, with the same answers: nothing is fused, and no sum is taken in another order.
Functions marked ``MVREG_CLONES`` are compiled for both, and the loader chooses.
"""

cdef extern from *:
    """
    #ifndef MVREG_WIDE
    #include <stdlib.h>
    #if defined(__SSE2__) || defined(_M_X64)
    #include <emmintrin.h>
    #define MVREG_WIDE 1
    #else
    #define MVREG_WIDE 0
    #endif
    #if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
    #include <immintrin.h>
    #define MVREG_WIDER 1
    #define MVREG_CLONES __attribute__((target_clones("avx2", "default")))
    #else
    #define MVREG_WIDER 0
    #define MVREG_CLONES
    #endif
    #endif
    """
    const bint WIDE "MVREG_WIDE"
