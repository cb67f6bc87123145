# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Rigid motions for the kernels: small enough to stand in line."""

from libc.math cimport atan2, cos, fabs, sin, sqrt

# A motion is twelve numbers: the rows of the rotation, then the translation.
ctypedef double[12] Motion


cdef inline void move(const double* motion, const double* x, double* moved) noexcept nogil:
    moved[0] = motion[0] * x[0] + motion[1] * x[1] + motion[2] * x[2] + motion[9]
    moved[1] = motion[3] * x[0] + motion[4] * x[1] + motion[5] * x[2] + motion[10]
    moved[2] = motion[6] * x[0] + motion[7] * x[1] + motion[8] * x[2] + motion[11]


cdef inline void copy(const double* motion, double* other) noexcept nogil:
    cdef int m
    for m in range(12):
        other[m] = motion[m]


cdef inline void turn(const double* motion, const double* x, double* turned) noexcept nogil:
    """A motion without its translation."""
    cdef int i
    for i in range(3):
        turned[i] = motion[3 * i] * x[0] + motion[3 * i + 1] * x[1] + motion[3 * i + 2] * x[2]


cdef inline void turn_back(const double* motion, const double* x, double* turned) noexcept nogil:
    """The inverse of `turn`: by the transposed rotation."""
    cdef int i
    for i in range(3):
        turned[i] = motion[i] * x[0] + motion[3 + i] * x[1] + motion[6 + i] * x[2]


cdef inline int of_array(const double[:, ::1] transform, double* motion) except -1:
    """The motion of a (4, 4) array."""
    cdef int i, j
    if transform.shape[0] != 4 or transform.shape[1] != 4:
        raise ValueError(
            f"expected a motion (4, 4), got {(transform.shape[0], transform.shape[1])}")
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = transform[i, j]
        motion[9 + i] = transform[i, 3]
    return 0


cdef inline void to_array(const double* motion, double[:, ::1] transform) noexcept nogil:
    """Fill the first three rows of a (4, 4) array."""
    cdef int i, j
    for i in range(3):
        for j in range(3):
            transform[i, j] = motion[3 * i + j]
        transform[i, 3] = motion[9 + i]


cdef inline double dot(const double* a, const double* b) noexcept nogil:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


cdef inline double plane_height(
    const double* x, const double* point, const double* normal
) noexcept nogil:
    """The signed distance of x from the plane through a point with a unit normal."""
    return ((x[0] - point[0]) * normal[0] + (x[1] - point[1]) * normal[1]
            + (x[2] - point[2]) * normal[2])


cdef inline void outer_sum(
    double* h, const double* a, const double* mean_a, const double* b, const double* mean_b
) noexcept nogil:
    """Add ``(a - mean_a) (b - mean_b)^T`` to a (3, 3) matrix."""
    cdef int j, k
    for j in range(3):
        for k in range(3):
            h[3 * j + k] += (a[j] - mean_a[j]) * (b[k] - mean_b[k])


cdef inline double norm(const double* x) noexcept nogil:
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


cdef inline void cross(const double* a, const double* b, double* product) noexcept nogil:
    """``a x b``; `product` is neither of them."""
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]


cdef inline double squared_gap(const double* a, const double* b) noexcept nogil:
    return ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])
            + (a[2] - b[2]) * (a[2] - b[2]))


cdef inline void diagonalise(double* a, double* v, int size) noexcept nogil:
    """Turn a symmetric matrix into its eigenvalues on the diagonal; eigenvectors are columns of v.

    By Jacobi's rotations: exact to rounding, also where eigenvalues coincide.
    """
    cdef double off, whole, theta, t, c, s, x, y
    cdef int i, j, k, sweep
    for i in range(size * size):
        v[i] = 1.0 if i % (size + 1) == 0 else 0.0
    for sweep in range(30):
        off, whole = 0.0, 0.0
        for i in range(size):
            whole += a[(size + 1) * i] * a[(size + 1) * i]
            for j in range(i + 1, size):
                off += a[size * i + j] * a[size * i + j]
        if off <= 1e-32 * whole:
            break
        for i in range(size - 1):
            for j in range(i + 1, size):
                if a[size * i + j] == 0:
                    continue
                theta = (a[(size + 1) * j] - a[(size + 1) * i]) / (2 * a[size * i + j])
                t = 1 / (fabs(theta) + sqrt(theta * theta + 1))
                if theta < 0:
                    t = -t
                c = 1 / sqrt(t * t + 1)
                s = t * c
                for k in range(size):
                    x, y = a[size * k + i], a[size * k + j]
                    a[size * k + i], a[size * k + j] = c * x - s * y, s * x + c * y
                for k in range(size):
                    x, y = a[size * i + k], a[size * j + k]
                    a[size * i + k], a[size * j + k] = c * x - s * y, s * x + c * y
                for k in range(size):
                    x, y = v[size * k + i], v[size * k + j]
                    v[size * k + i], v[size * k + j] = c * x - s * y, s * x + c * y


cdef inline void largest_vector(double* a, double* vector) noexcept nogil:
    """The eigenvector of the largest eigenvalue of a symmetric 4x4 matrix, which is spoilt."""
    cdef double v[16]
    cdef int i, best = 0
    diagonalise(a, v, 4)
    for i in range(1, 4):
        if a[5 * i] > a[5 * best]:
            best = i
    for i in range(4):
        vector[i] = v[4 * i + best]


cdef inline void smallest_vector(double* a, double* vector) noexcept nogil:
    """The eigenvector of the smallest eigenvalue of a symmetric 3x3 matrix, which is spoilt."""
    cdef double v[9]
    cdef int i, best = 0
    diagonalise(a, v, 3)
    for i in range(1, 3):
        if a[4 * i] < a[4 * best]:
            best = i
    for i in range(3):
        vector[i] = v[3 * i + best]


cdef inline void kabsch(
    const double* h, const double* mean_source, const double* mean_target, double* motion
) noexcept nogil:
    """The motion that fits best, from the sums ``H = sum (source - mean) (target - mean)^T``.

    By unit quaternions (Horn 1987): always a proper rotation, also for flat or collinear points.
    """
    cdef double a[16]
    cdef double q[4]
    cdef double w, x, y, z
    cdef int i, j
    a[0] = h[0] + h[4] + h[8]
    a[1] = h[5] - h[7]
    a[2] = h[6] - h[2]
    a[3] = h[1] - h[3]
    a[5] = h[0] - h[4] - h[8]
    a[6] = h[1] + h[3]
    a[7] = h[6] + h[2]
    a[10] = h[4] - h[0] - h[8]
    a[11] = h[5] + h[7]
    a[15] = h[8] - h[0] - h[4]
    for i in range(4):
        for j in range(i):
            a[4 * i + j] = a[4 * j + i]
    largest_vector(a, q)
    w, x, y, z = q[0], q[1], q[2], q[3]
    motion[0] = w * w + x * x - y * y - z * z
    motion[1] = 2 * (x * y - w * z)
    motion[2] = 2 * (x * z + w * y)
    motion[3] = 2 * (x * y + w * z)
    motion[4] = w * w - x * x + y * y - z * z
    motion[5] = 2 * (y * z - w * x)
    motion[6] = 2 * (x * z - w * y)
    motion[7] = 2 * (y * z + w * x)
    motion[8] = w * w - x * x - y * y + z * z
    for i in range(3):
        motion[9 + i] = mean_target[i] - (motion[3 * i] * mean_source[0]
                                          + motion[3 * i + 1] * mean_source[1]
                                          + motion[3 * i + 2] * mean_source[2])


cdef inline void exponential(const double* twist, double* motion) noexcept nogil:
    """The motion of a twist (turn, shift), as `mvreg.geometry.se3.exp`."""
    cdef double square = twist[0] * twist[0] + twist[1] * twist[1] + twist[2] * twist[2]
    cdef double angle = sqrt(square), first, second, third
    cdef double k[9]
    cdef double k2[9]
    cdef int i, j, m
    if angle < 1e-2:
        first = 1 - square / 6 + square * square / 120
        second = 0.5 - square / 24 + square * square / 720
        third = 1.0 / 6 - square / 120
    else:
        first = sin(angle) / angle
        second = 2 * (sin(angle / 2) / angle) * (sin(angle / 2) / angle)
        third = (angle - sin(angle)) / (angle * square)
    k[0], k[1], k[2] = 0, -twist[2], twist[1]
    k[3], k[4], k[5] = twist[2], 0, -twist[0]
    k[6], k[7], k[8] = -twist[1], twist[0], 0
    for i in range(3):
        for j in range(3):
            k2[3 * i + j] = 0
            for m in range(3):
                k2[3 * i + j] += k[3 * i + m] * k[3 * m + j]
    for i in range(9):
        motion[i] = (1.0 if i % 4 == 0 else 0.0) + first * k[i] + second * k2[i]
    for i in range(3):
        motion[9 + i] = twist[3 + i]
        for j in range(3):
            motion[9 + i] += (second * k[3 * i + j] + third * k2[3 * i + j]) * twist[3 + j]


cdef inline void compose(const double* a, const double* b, double* product) noexcept nogil:
    """``a @ b``; `product` is neither of them."""
    cdef int i, j
    for i in range(3):
        for j in range(3):
            product[3 * i + j] = (a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j]
                                  + a[3 * i + 2] * b[6 + j])
        product[9 + i] = (a[3 * i] * b[9] + a[3 * i + 1] * b[10] + a[3 * i + 2] * b[11]
                          + a[9 + i])


cdef inline void turn_of(const double* motion, double* vector) noexcept nogil:
    """Axis times angle of a rotation that is well under half a turn."""
    cdef double x = motion[7] - motion[5], y = motion[2] - motion[6], z = motion[3] - motion[1]
    cdef double sine = sqrt(x * x + y * y + z * z)  # twice the angle's
    cdef double angle = atan2(sine, motion[0] + motion[4] + motion[8] - 1)
    cdef double factor = angle / sine if sine > 1e-12 else 0.5
    vector[0], vector[1], vector[2] = factor * x, factor * y, factor * z


cdef inline bint solve(double* a, double* b, int size) noexcept nogil:
    """Solve a positive definite system of `size` rows in place (Cholesky); False if it is not."""
    cdef int i, j, k
    cdef double total
    for i in range(size):
        for j in range(i + 1):
            total = a[size * i + j]
            for k in range(j):
                total -= a[size * i + k] * a[size * j + k]
            if i == j:
                if not total > 0:
                    return False
                a[(size + 1) * i] = sqrt(total)
            else:
                a[size * i + j] = total / a[(size + 1) * j]
    for i in range(size):
        for k in range(i):
            b[i] -= a[size * i + k] * b[k]
        b[i] /= a[(size + 1) * i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            b[i] -= a[size * k + i] * b[k]
        b[i] /= a[(size + 1) * i]
    return True
