"""Measures of a registration by its trimmed pairs: residual, normals, localizability."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Registration, View


def surface_fit(registration: Registration, source: View, target: View) -> tuple[float, float]:
    """How well the trimmed pairs lie in one surface.

    Parameters
    ----------
    registration : Registration
        Its `pairs` (P, 2), at least one, are measured under its pose.
    source, target : View
        What was registered, each in its own frame.

    Returns
    -------
    residual : float
        Root mean square distance of the moved source points to the target's tangent planes, in
        units of the resolution of the down-sampled scans.
    agreement : float
        Mean cosine between the paired normals; of unsigned normals, its absolute value.
    """
    moved, stay = registration.pairs.T
    transform = registration.T_target_source
    gaps = se3.apply(transform, source.points[moved]) - target.points[stay]
    normals = target.normals[stay]
    cosine = ((source.normals[moved] @ transform[:3, :3].T) * normals).sum(axis=1)
    if not (source.features.oriented and target.features.oriented):
        cosine = np.abs(cosine)
    residual = np.sqrt(((gaps * normals).sum(axis=1) ** 2).mean())
    return float(residual) / (source.scale.resolution or 1.0), float(cosine.mean())


def localizability(registration: Registration, source: View, target: View) -> float:
    """How well the trimmed pairs constrain the source in its least constrained direction.

    The smallest eigenvalue of the mean of ``J^T J``, ``J = [p x n, n]``, with the points p about
    their centre and in units of their root mean square radius: 0 where a sphere, a cylinder or a
    plane slides along itself (Gelfand et al. 2003, geometrically stable sampling).

    Parameters
    ----------
    registration : Registration
        Its `pairs` (P, 2), at least one, are measured under its pose.
    source, target : View
        What was registered, each in its own frame.

    Returns
    -------
    float
        0 or more, without unit.
    """
    moved, stay = registration.pairs.T
    points = se3.apply(registration.T_target_source, source.points[moved])
    points = points - points.mean(axis=0)
    radius = np.sqrt((points**2).sum(axis=1).mean())
    normals = target.normals[stay]
    jacobian = np.hstack([np.cross(points / (radius or 1.0), normals), normals])
    smallest = np.linalg.eigvalsh(jacobian.T @ jacobian / len(jacobian))[0]
    return max(float(smallest), 0.0)  # rounding may leave it below


def underconstrained(
    registration: Registration,
    source: View,
    target: View,
    min_overlap: float,
    min_localizability: float,
) -> str | None:
    """Why the trimmed pairs do not hold the source well enough, None where they do.

    Parameters
    ----------
    registration, source, target
        As a judge is given them.
    min_overlap : float
        Smallest share of the source that is kept.
    min_localizability : float
        See `localizability`.

    Returns
    -------
    str or None
        A `Verdict.reason`.
    """
    if registration.overlap < min_overlap:
        return f"overlap below {min_overlap:g}"
    if localizability(registration, source, target) < min_localizability:
        return "ambiguous: the overlap can slide along itself"
    return None


def length_read_as_one(view: View, reference_resolution: float) -> float:
    """The unit in which the down-sampled scans' resolution is `reference_resolution` (length).

    For criteria that compare squared lengths with lengths, which makes them depend on the unit.
    """
    return view.scale.resolution / reference_resolution or 1.0
