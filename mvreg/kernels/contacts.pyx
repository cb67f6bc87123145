# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Which samples of surfaces lie on the patches of others."""

from libc.math cimport fabs, fmin
from libc.string cimport memcpy
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, move, turn
from mvreg.kernels.patches cimport Patch, Patches, between, height, one_of, placed

import numpy as np

from mvreg.kernels import checks
from mvreg.kernels.results import PatchContacts

# No surface has so many samples.
cdef enum:
    FARTHEST = 1 << 30

# Which contacts count; how far apart they may be is squared.
cdef struct Gate:
    double squared
    double least_cosine
    Py_ssize_t stride
    bint flat
    bint oriented


def contacts(
    surfaces, motions, ways, double reach, Py_ssize_t stride, bint flat, double least_cosine,
    oriented
):
    """Where the samples of surfaces, as the means of their cells, lie on the patches of others.

    A sample finds the patch whose origin is nearest; that must be whole, the sample's cell usable,
    and the normals agree.

    Parameters
    ----------
    surfaces : sequence of Patches
        N of them.
    motions : (N, 4, 4) array
        From the surfaces' frames to a common one.
    ways : (W, 2) array
        Positions of sources and of targets among the surfaces.
    reach : float
        No patch whose origin is farther away counts.
    stride : int
        Every n-th sample is used.
    flat : bool
        Ask tangent planes, however far away from their middle; else a sample must lie on the patch
        no farther along than the patch reaches.
    least_cosine : float
        Of the angle between the normals.
    oriented : (N,) array of bool
        Whether the normals' signs mean anything; they must for both.

    Returns
    -------
    PatchContacts
    """
    cdef Py_ssize_t count = len(surfaces), w
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = checks.indices("ways", ways, count, "W", 2)
    cdef const unsigned char[::1] signs = checks.flags("oriented", oriented, count)
    cdef vector[int] samples, patches
    cdef Patches source, target
    cdef Gate gate
    if stride < 1:
        raise ValueError(f"expected a stride of 1 or more, got {stride}")
    gate.squared = fmin(reach, 1e150) * fmin(reach, 1e150)
    gate.stride, gate.flat, gate.least_cosine = min(stride, FARTHEST), flat, least_cosine
    ends = np.zeros(way.shape[0] + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] end = ends
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        gate.oriented = signs[way[w, 0]] and signs[way[w, 1]]
        with nogil:
            touch(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]], &gate,
                  samples, patches)
        end[w + 1] = samples.size()
    return PatchContacts(ends, of_vector(samples), of_vector(patches))


cdef void touch(
    Patches source, Patches target, const double* from_source, const double* from_target,
    const Gate* gate, vector[int]& samples, vector[int]& patches
) noexcept nogil:
    """Add the contacts of one surface with another."""
    cdef Motion motion
    cdef double x[3]
    cdef double squared
    cdef Py_ssize_t asked, k, found
    cdef const Patch* here
    between(from_source, from_target, motion)
    for asked in range((source.size + gate.stride - 1) // gate.stride):
        k = gate.stride * asked
        here = &source.patch[k]
        if here.usable:
            move(motion, here.mean, x)
            squared = gate.squared
            found = target.tree.find(x, &squared)
            if found >= 0 and agree(here, &target.patch[found], x, motion, gate):
                samples.push_back(<int> k)
                patches.push_back(<int> found)


cdef inline bint agree(
    const Patch* here, const Patch* there, const double* x, const double* motion, const Gate* gate
) noexcept nogil:
    """Whether a sample, moved to x, lies on the patch that is nearest."""
    cdef double normal[3]
    cdef double turned[3]
    cdef double aside, cosine
    if not there.whole:
        return False
    height(there, x, gate.flat, normal, &aside)
    if not gate.flat and aside > there.reach * there.reach:
        return False
    turn(motion, here.normal, turned)
    cosine = turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2]
    return (cosine if gate.oriented else fabs(cosine)) > gate.least_cosine


cdef of_vector(vector[int]& values):
    found = np.empty(values.size(), dtype=np.intc)
    cdef int[::1] view = found
    if values.size():
        memcpy(&view[0], values.data(), values.size() * sizeof(int))
    return found
