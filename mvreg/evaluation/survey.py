"""What surveyors ask of a registration: spread per link, weakest axes, loops, accuracy levels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.parallel import in_parts
from mvreg.surface.contact import surface_spacing
from mvreg.surface.overlap import (
    CONTACT_DISTANCE,
    LEAST_COSINE,
    build_trees,
    neighbours,
    sampled,
)
from mvreg.types import Array, View
from mvreg.types.view_graph import breadth_first

#: What a direction in which a link holds nothing is damped by (share of the best held one).
DAMPING = 1e-3
#: Links with fewer contacts, or held so little in some direction (mean square of the normals' part
#: in it), close no loop: what they prefer there is noise.
FEWEST_CONTACTS, LEAST_HELD = 100, 0.03
#: Of larger sets no more loops are told than this, the worst.
MOST_LOOPS = 50


@dataclass(frozen=True, eq=False)
class LinkSurvey:
    """Two scans that overlap, as their contacts alone would have them.

    Parameters
    ----------
    source, target : str
    points : int
        Contacts, of both directions.
    rms, p95 : float
        Root mean square and 95 per cent quantile of the point-to-plane distances (length).
    weakest_axis : (3,) array
        Unit vector in the model frame along which the link holds the two least.
    weakest_sigma : float
        Standard deviation of their distance along it (length), by the spread of the distances as
        if these were independent.
    twist : (6,) array
        The small motion of the source about `centre` that its contacts with the target prefer,
        rotation (radians) before translation; model frame.
    centre : (3,) array
    held : float
        How well the contacts hold the direction that they hold least, shifts and turns alike: the
        mean square of their normals' part in it.
    """

    source: str
    target: str
    points: int
    rms: float
    p95: float
    weakest_axis: Array
    weakest_sigma: float
    twist: Array
    centre: Array
    held: float


@dataclass(frozen=True)
class LoopClosure:
    """A loop of links, and how far it fails to close.

    `names` lead around; `angle` is in degrees, `translation` a length, in the middle of the loop.
    """

    names: tuple[str, ...]
    angle: float
    translation: float


def survey_links(poses: Mapping[str, Array], views: Sequence[View]) -> list[LinkSurvey]:
    """Every pair of placed views in contact, by itself.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan`` of one partial model; views without a pose are left out.
    views : sequence of View
    """
    placed = [view for view in views if view.name in poses and len(view.points)]
    reach = CONTACT_DISTANCE * max((surface_spacing(view) for view in placed), default=0.0)
    if len(placed) < 2 or not reach > 0:
        return []
    build_trees(placed)
    pairs = [(i, j) for i, j in neighbours(placed, poses, reach) if i < j]
    found = in_parts(lambda pair: _surveyed(placed[pair[0]], placed[pair[1]], poses), pairs)
    return [link for link in found if link is not None]


def _surveyed(source: View, target: View, poses: Mapping[str, Array]) -> LinkSurvey | None:
    """One link; the rows of both directions are those of a motion of the source."""
    there = _rows(source, target, poses)
    back = _rows(target, source, poses)
    points = np.concatenate([there[0], back[0]])
    normals = np.concatenate([there[1], -back[1]])
    heights = np.concatenate([there[2], back[2]])
    if len(points) < 6:
        return None
    centre = points.mean(axis=0)
    jacobian = np.hstack([np.cross(points - centre, normals), normals])
    size = float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean())) or 1.0
    scaled = jacobian / np.array([size] * 3 + [1.0] * 3)
    width = 2 * 1.4826 * float(np.median(np.abs(heights))) or 1.0
    weights = 1 / (1 + (heights / width) ** 2) ** 2  # Geman and McClure, as the joint refinement
    normal = scaled.T @ (weights[:, None] * scaled)
    strengths = np.linalg.eigvalsh(normal)
    damped = normal + DAMPING * strengths[-1] * np.eye(6)
    step = np.linalg.solve(damped, -scaled.T @ (weights * heights))
    twist = step / np.array([size] * 3 + [1.0] * 3)
    rms = float(np.sqrt(np.mean(heights**2)))
    held, axes = np.linalg.eigh(normals.T @ normals)
    sigma = rms / np.sqrt(max(float(held[0]), 1e-9 * len(points)))
    return LinkSurvey(
        source.name, target.name, len(points), rms, float(np.quantile(np.abs(heights), 0.95)),
        axes[:, 0], float(sigma), twist, centre, float(strengths[0] / weights.sum()),
    )  # fmt: skip


def _rows(source: View, target: View, poses: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """Points (M, 3), planes' normals (M, 3) and signed heights (M,) of contacts; model frame."""
    chosen = sampled(source)
    T_target_source = se3.invert(poses[target.name]) @ poses[source.name]
    moved = se3.apply(T_target_source, source.points[chosen])
    turned = source.normals[chosen] @ T_target_source[:3, :3].T
    distances, indices = nearest(target.tree, moved, CONTACT_DISTANCE * surface_spacing(target))
    near = np.flatnonzero(np.isfinite(distances))
    planes = target.normals[indices[near]]
    near = near[(turned[near] * planes).sum(axis=1) >= LEAST_COSINE]
    planes, feet = target.normals[indices[near]], target.points[indices[near]]
    heights = ((moved[near] - feet) * planes).sum(axis=1)
    pose = poses[target.name]
    return se3.apply(pose, moved[near]), planes @ pose[:3, :3].T, heights


def loop_closures(links: Sequence[LinkSurvey]) -> list[LoopClosure]:
    """Loops of links and how far they fail to close, the worst translation first.

    Every link prefers its own motion; around a loop these should add to nothing. For each link
    outside a spanning tree the shortest loop that it closes is taken: as many as are independent.
    Links that do not hold all directions are left out.
    """
    links = [link for link in links if link.points >= FEWEST_CONTACTS and link.held >= LEAST_HELD]
    ways: dict[str, dict[str, tuple[LinkSurvey, float]]] = {}
    for link in links:
        ways.setdefault(link.source, {})[link.target] = (link, 1.0)
        ways.setdefault(link.target, {})[link.source] = (link, -1.0)
    found = [_closure(_shortest(link, ways), ways) for link in outside_tree(links)]
    return sorted(found, key=lambda loop: -loop.translation)[:MOST_LOOPS]


def _shortest(link: LinkSurvey, ways: Mapping[str, Mapping[str, object]]) -> list[str]:
    """The names along the shortest way from the source of a link to its target, without it.

    Nearly always that is by a scan that both are linked with, which is looked for first: all ways
    are searched only where there is none.
    """
    source, target = link.source, link.target
    for between in ways[target]:
        if between in ways[source]:
            return [source, between, target]
    rest: dict[str, Iterable[str]] = {**ways}
    rest[source] = [other for other in ways[source] if other != target]
    rest[target] = [other for other in ways[target] if other != source]
    before = breadth_first(target, rest)
    names = [source]
    while (step := before[names[-1]]) is not None:
        names.append(step)
    return names


def outside_tree(links: Sequence[LinkSurvey]) -> list[LinkSurvey]:
    """The links that a spanning forest of those with the most contacts leaves out."""
    parent: dict[str, str] = {}

    def root(name: str) -> str:
        while parent.setdefault(name, name) != name:
            name = parent[name]
        return name

    left = []
    for link in sorted(links, key=lambda link: -link.points):
        first, second = root(link.source), root(link.target)
        if first == second:
            left.append(link)
        parent[first] = second
    return left


def _closure(
    names: Sequence[str], ways: Mapping[str, Mapping[str, tuple[LinkSurvey, float]]]
) -> LoopClosure:
    steps = [ways[a][b] for a, b in zip(names, [*names[1:], names[0]], strict=True)]
    middle = np.mean([link.centre for link, _ in steps], axis=0)
    turn = sum((sign * link.twist[:3] for link, sign in steps), np.zeros(3))
    shift = sum(
        (sign * (link.twist[3:] + np.cross(link.twist[:3], middle - link.centre))
         for link, sign in steps),
        np.zeros(3),
    )  # fmt: skip
    angle = float(np.degrees(np.linalg.norm(turn)))
    return LoopClosure(tuple(names), angle, float(np.linalg.norm(shift)))


#: Millimetres in a unit of length.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "km": 1e6, "in": 25.4, "ft": 304.8}
#: USIBD's levels of accuracy (Level of Accuracy Specification): the largest 95 per cent error (mm).
LEVELS = {"LOA50": 1.0, "LOA40": 5.0, "LOA30": 15.0, "LOA20": 50.0, "LOA10": 150.0}


def level_of_accuracy(error: float, unit: str) -> str | None:
    """USIBD's level of accuracy that a 95 per cent error (length) reaches.

    None where the unit is not known; "none" where the error is larger than all levels allow.
    """
    if unit not in MILLIMETRES or not np.isfinite(error):
        return None
    millimetres = error * MILLIMETRES[unit]
    return next((level for level, most in LEVELS.items() if millimetres <= most), "none")
