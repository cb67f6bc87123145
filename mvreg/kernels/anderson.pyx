# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Anderson acceleration of ICP."""

from libc.math cimport sqrt

from mvreg.kernels.linear cimport Motion, copy, exponential, solve, squared_gap, turn_of

# Added to the diagonal of the normal equations, as a share of their trace.
cdef double REGULAR = 1e-9


cdef class Acceleration:
    """Anderson acceleration of a sequence of poses: a leap to where the last few steps lead.

    After Zhang, Yao and Deng, "Fast and robust iterative closest point", PAMI 2022: poses as
    twists, from the first one, of which the turn counts by the radius of the cloud.
    """

    def __init__(self, pairing):
        self.pairing = pairing
        self.held = -1

    cdef void forget(self) noexcept nogil:
        self.held = min(self.held, 0)

    cdef void begin(self, const double* motion) noexcept nogil:
        """Twists are told from this pose, about the middle of the cloud."""
        cdef Py_ssize_t i
        cdef int m
        copy(motion, self.base)
        for m in range(3):
            self.centre[m] = 0
        for i in range(self.pairing.size):
            for m in range(3):
                self.centre[m] += self.pairing.moved[3 * i + m] / self.pairing.size
        self.radius = 0
        for i in range(self.pairing.size):
            self.radius += squared_gap(&self.pairing.moved[3 * i], self.centre)
        self.radius = sqrt(self.radius / self.pairing.size)
        if self.radius == 0:
            self.radius = 1
        self.held = 0

    cdef void coordinates(self, const double* motion, double* six) noexcept nogil:
        """The turn from the base, times the radius, and where the middle goes."""
        cdef double turn[9]
        cdef double inside[3]
        cdef int i, j
        for i in range(3):
            for j in range(3):
                turn[3 * i + j] = (motion[3 * i] * self.base[3 * j]
                                   + motion[3 * i + 1] * self.base[3 * j + 1]
                                   + motion[3 * i + 2] * self.base[3 * j + 2])
        turn_of(turn, six)
        for i in range(3):
            six[i] *= self.radius
            inside[i] = 0
            for j in range(3):
                inside[i] += turn[3 * i + j] * (self.centre[j] - self.base[9 + j])
            six[3 + i] = inside[i] + motion[9 + i] - self.centre[i]

    cdef void motion_at(self, const double* six, double* motion) noexcept nogil:
        """The pose of coordinates."""
        cdef double twist[6]
        cdef Motion turn
        cdef int i, j
        for i in range(3):
            twist[i] = six[i] / self.radius
            twist[3 + i] = 0
        exponential(twist, turn)
        for i in range(3):
            for j in range(3):
                motion[3 * i + j] = (turn[3 * i] * self.base[j] + turn[3 * i + 1] * self.base[3 + j]
                                     + turn[3 * i + 2] * self.base[6 + j])
            motion[9 + i] = six[3 + i] + self.centre[i]
            for j in range(3):
                motion[9 + i] += turn[3 * i + j] * (self.base[9 + j] - self.centre[j])

    cdef bint leap(self, double* motion, const double* plain) noexcept nogil:
        """From the pose that led to `plain` to the next one; whether it is another than that."""
        cdef double normal[MEMORY * MEMORY]
        cdef double share[MEMORY]
        cdef double apart[MEMORY][6]
        cdef double six[6]
        cdef double last[6]
        cdef double trace = 0
        cdef int newest, older, i, j, m
        if self.held < 0:
            self.begin(motion)
        if self.held == MEMORY:
            for i in range(MEMORY - 1):
                for m in range(6):
                    self.at[i][m], self.to[i][m] = self.at[i + 1][m], self.to[i + 1][m]
            self.held -= 1
        newest = self.held
        self.coordinates(motion, self.at[newest])
        self.coordinates(plain, self.to[newest])
        self.held += 1
        copy(plain, motion)
        if newest == 0:
            return False
        for m in range(6):
            last[m] = self.to[newest][m] - self.at[newest][m]
        for i in range(newest):
            for m in range(6):
                apart[i][m] = last[m] - (self.to[i][m] - self.at[i][m])
        for i in range(newest):
            share[i] = 0
            for m in range(6):
                share[i] += apart[i][m] * last[m]
            for j in range(newest):
                normal[newest * i + j] = 0
                for m in range(6):
                    normal[newest * i + j] += apart[i][m] * apart[j][m]
            trace += normal[(newest + 1) * i]
        for i in range(newest):
            normal[(newest + 1) * i] += REGULAR * trace
        if not solve(normal, share, newest):
            return False
        for m in range(6):
            six[m] = self.to[newest][m]
            for i in range(newest):
                six[m] -= share[i] * (self.to[newest][m] - self.to[i][m])
        self.motion_at(six, motion)
        return True
