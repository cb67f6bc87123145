# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Rows of decimal numbers, from bytes to float64, each bit for bit as `float` reads it.

A whole number of at most 2**53 times or over a power of ten up to 10**22 is correctly rounded by
that one operation, because both are exact (Clinger 1990, "How to read floating point numbers
accurately"). All other words are CPython's.
"""

import numpy as np

from libc.stdint cimport uint64_t

cdef extern from *:
    """
    static const double POWERS[23] = {
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11,
        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    #define EXACT ((uint64_t)1 << 53)
    #define PyOS_as_float(word, end) PyOS_string_to_double(word, end, NULL)
    """
    const double POWERS[23]
    const uint64_t EXACT
    double PyOS_as_float(const char* word, char** end) except? -1.0

cdef enum:
    MOST_DIGITS = 19  # 10**19 < 2**64
    MOST_POWER = 22
    BATCH = 1000


def parse_rows(bytes data not None, Py_ssize_t start, Py_ssize_t rows, Py_ssize_t columns):
    """See the stub."""
    cdef Py_ssize_t size = len(data), row = 0, last
    if not 0 <= start <= size or rows < 1 or columns < 1:
        return None
    # A number takes two bytes with what follows it: no memory for a count that is made up.
    if rows > (size - start + 1) // 2 // columns:
        return None
    table = np.empty((rows, columns))
    cdef double[:, ::1] numbers = table
    cdef const char* text = data
    cdef const char* at = text + start
    while row < rows:
        with nogil:
            row = _rows(&at, text + size, &numbers[0, 0], columns, row, rows, False)
        # Words for CPython need its lock: some rows at once, lest threads wait for it at each word.
        last = min(row + BATCH, rows)
        row = _rows(&at, text + size, &numbers[0, 0], columns, row, last, True)
        if row < last:
            return None
    return table, at - text


cdef Py_ssize_t _rows(
    const char** start, const char* end, double* numbers, Py_ssize_t columns,
    Py_ssize_t row, Py_ssize_t rows, bint any_word,
) noexcept nogil:
    """Parse up to row `rows`; the first row that could not be parsed, where `start` then is."""
    cdef const char* at
    cdef Py_ssize_t column
    while row < rows:
        at = start[0]
        for column in range(columns):
            while _blank(at[0]):
                at += 1
            at = _number(at, &numbers[row * columns + column], any_word)
            if at == NULL or not (_blank(at[0]) or at[0] == c"\n" or at == end):
                return row
        while _blank(at[0]):
            at += 1
        if at == end:
            at -= 1
        elif at[0] != c"\n":
            return row
        start[0] = at + 1
        row += 1
    return row


cdef inline bint _blank(char c) noexcept nogil:
    return c == c" " or c == c"\t" or c == c"\r" or c == c"\v" or c == c"\f"


cdef inline const char* _digits(const char* at, uint64_t* number) noexcept nogil:
    """Append digits to a number, which wraps around beyond 19 of them; where they end."""
    while c"0" <= at[0] <= c"9":
        number[0] = 10 * number[0] + (at[0] - c"0")
        at += 1
    return at


cdef inline const char* _power(const char* at, Py_ssize_t* exponent) noexcept nogil:
    """Add what follows an "e"; where it ends, or NULL."""
    cdef bint negative = at[0] == c"-"
    cdef const char* first = at + (at[0] == c"-" or at[0] == c"+")
    cdef uint64_t power = 0
    at = _digits(first, &power)
    if not 0 < at - first <= 4:
        return NULL
    exponent[0] += -<Py_ssize_t>power if negative else <Py_ssize_t>power
    return at


cdef inline const char* _number(const char* word, double* value, bint any_word) noexcept nogil:
    """Parse one word; where it ends, or NULL."""
    cdef const char* first = word + (word[0] == c"-" or word[0] == c"+")
    cdef uint64_t mantissa = 0
    cdef const char* at = _digits(first, &mantissa)
    cdef Py_ssize_t count = at - first, exponent = 0
    if at[0] == c".":
        first = at + 1
        at = _digits(first, &mantissa)
        exponent = first - at
        count -= exponent
    if at[0] == c"e" or at[0] == c"E":
        at = _power(at + 1, &exponent)
    if not 0 < count <= MOST_DIGITS or mantissa > EXACT or at == NULL or not (
        -MOST_POWER <= exponent <= MOST_POWER
    ):
        return _any_word(word, value) if any_word else NULL
    if exponent < 0:
        value[0] = <double>mantissa / POWERS[-exponent]
    else:
        value[0] = <double>mantissa * POWERS[exponent]
    if word[0] == c"-":
        value[0] = -value[0]
    return at


cdef const char* _any_word(const char* word, double* value) noexcept with gil:
    """What `float` takes and the above does not; where it ends, or NULL."""
    cdef char* end
    try:
        value[0] = PyOS_as_float(word, &end)
    except ValueError:
        return NULL
    return end
