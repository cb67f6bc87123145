"""Reference of `mvreg.kernels.icp`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array, Indices

#: Poses that the acceleration remembers, and what keeps its equations solvable.
MEMORY, REGULAR = 6, 1e-9

Pairs = tuple[Indices, Indices, Array, float]


def trim(distances: Array, min_overlap: float, power: float) -> tuple[int, float]:
    """How many of the ascending `distances` (N,) to keep, and the objective psi (length^2).

    For a fixed number of pairs the sum of squares is smallest over the smallest distances, so the
    best subset is a prefix of the sorted list: one cumulative sum finds it exactly.
    """
    size = len(distances)
    count = np.arange(1, size + 1)
    psi = np.cumsum(distances**2) / count * (size / count) ** power  # Eq. (3), (4)
    first = max(int(np.ceil(min_overlap * size)), 1) - 1
    best = first + int(psi[first:].argmin())
    return best + 1, float(psi[best])


def trimmed(target: Array, moved: Array, min_overlap: float, power: float) -> Pairs:
    """The nearest of target (M, 3) to each of moved (N, 3), trimmed: chosen, targets, distances."""
    from scipy.spatial import cKDTree

    distances, indices = cKDTree(target).query(moved)
    order = np.argsort(distances, kind="stable")
    keep, psi = trim(distances[order], min_overlap, power)
    chosen = order[:keep]
    return chosen, indices[chosen], distances[chosen], psi


def trimmed_icp(
    target: Array,
    points: Array,
    transform: Array,
    min_overlap: float,
    power: float,
    max_iterations: int,
    tolerance: float,
) -> tuple[Array, Pairs, int, bool]:
    """Trimmed ICP, each step from where the last few lead to, unless that makes psi larger."""
    ahead = Acceleration(se3.apply(transform, points), transform)
    plain, bold, previous, iteration = transform, False, np.inf, 0
    while True:
        pairs = trimmed(target, se3.apply(transform, points), min_overlap, power)
        if bold and not pairs[3] < previous:
            transform = plain
            ahead.forget()
            pairs = trimmed(target, se3.apply(transform, points), min_overlap, power)
        still = previous - pairs[3] <= tolerance * pairs[3]
        if still or iteration == max_iterations:
            return transform, pairs, iteration, bool(still)
        previous = pairs[3]
        plain = se3.fit(points[pairs[0]], target[pairs[1]])  # Eq. (5)
        transform, bold = ahead.leap(transform, plain)
        iteration += 1


class Acceleration:
    """Anderson acceleration of poses, as twists about the middle of the cloud (N, 3)."""

    def __init__(self, moved: Array, base: Array) -> None:
        self.base, self.centre = base, moved.mean(axis=0)
        radius = float(np.sqrt(((moved - self.centre) ** 2).sum(axis=1).mean()))
        self.radius = radius or 1.0
        self.at: list[Array] = []
        self.to: list[Array] = []

    def forget(self) -> None:
        """Discard the history: restart from the next step."""
        self.at, self.to = [], []

    def coordinates(self, pose: Array) -> Array:
        """The rotation vector from the base, times the radius, and the centroid's shift (6,)."""
        change = pose @ se3.invert(self.base)
        shift = se3.apply(change, self.centre) - self.centre
        return np.append(self.radius * se3.rotation_vector(change[:3, :3]), shift)

    def pose(self, six: Array) -> Array:
        """The pose of coordinates."""
        turn = se3.exp(np.append(six[:3] / self.radius, np.zeros(3)))[:3, :3]
        change = se3.from_parts(turn, self.centre + six[3:] - turn @ self.centre)
        return change @ self.base

    def leap(self, pose: Array, plain: Array) -> tuple[Array, bool]:
        """From the pose that led to `plain` to the next; whether it is another than that."""
        self.at, self.to = self.at[1 - MEMORY :], self.to[1 - MEMORY :]
        self.at.append(self.coordinates(pose))
        self.to.append(self.coordinates(plain))
        at, to = np.array(self.at), np.array(self.to)
        steps = to - at
        apart, ways = steps[-1] - steps[:-1], to[-1] - to[:-1]
        normal = apart @ apart.T
        if not np.trace(normal) > 0:
            return plain, False
        normal += REGULAR * np.trace(normal) * np.eye(len(normal))
        share = np.linalg.solve(normal, apart @ steps[-1])
        return self.pose(to[-1] - share @ ways), True
