# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Decompression of LZF, the format of Marc Lehmann's LibLZF, which PCD files use."""

import numpy as np

from libc.string cimport memcpy


def decompress(data, Py_ssize_t size):
    """See the stub."""
    cdef const unsigned char[::1] packed = data
    if not 0 <= size <= MOST_GROWTH * packed.shape[0]:
        return None
    found = np.empty(size, dtype=np.uint8)
    cdef unsigned char[::1] out = found
    cdef Py_ssize_t written = 0
    if packed.shape[0] and size:
        with nogil:
            written = _decompress(&packed[0], packed.shape[0], &out[0], size)
    return found if written == size else None


cdef enum:
    MOST_GROWTH = 100  # three bytes stand for 264 at most


cdef Py_ssize_t _decompress(
    const unsigned char* packed, Py_ssize_t length, unsigned char* out, Py_ssize_t size
) noexcept nogil:
    """The number of bytes written; -1 where the data end early, reach back too far or are more."""
    cdef Py_ssize_t at = 0, written = 0, count, back, i
    cdef unsigned char control
    while at < length:
        control = packed[at]
        at += 1
        if control < 32:  # so many bytes and one follow as they are
            count = control + 1
            if at + count > length or written + count > size:
                return -1
            memcpy(out + written, packed + at, count)
            at += count
        else:  # a copy of what was written before; it may reach into itself
            count = control >> 5
            if count == 7:
                if at >= length:
                    return -1
                count += packed[at]
                at += 1
            count += 2
            if at >= length:
                return -1
            back = ((control & 31) << 8) + packed[at] + 1
            at += 1
            if back > written or written + count > size:
                return -1
            for i in range(count):
                out[written + i] = out[written + i - back]
        written += count
    return written
