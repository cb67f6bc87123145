"""Partial models: which views are joined, and their relative poses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.evidence.pooled import Evidence, ViewPair, pool_evidence
from mvreg.geometry import se3
from mvreg.geometry.boxes import near_boxes
from mvreg.geometry.nearest import nearest
from mvreg.kernels.overlap import box
from mvreg.parallel import in_threads
from mvreg.surface.partners import well_spread
from mvreg.types import Array, Indices, Model, Part, Registration, View
from mvreg.types.lazy import kept_on_argument

#: Points of a view and of a model that are nearer than this are one (resolutions).
SAME = 1.0


class PartialModels:
    """Views in groups, at first each alone; `poses[i]` is ``T_group_view`` of view i.

    Parameters
    ----------
    views : sequence of View
    """

    def __init__(self, views: Sequence[View]) -> None:
        self.views = views
        self.poses: list[Array] = [np.eye(4) for _ in views]
        self.group: Indices = np.arange(len(views))

    def copy(self) -> PartialModels:
        """The same groups of the same views, to be changed by themselves."""
        other = PartialModels(self.views)
        other.poses, other.group = list(self.poses), self.group.copy()
        return other

    def members(self, group: int) -> Indices:
        """The views of a group, in the order of the views."""
        return np.flatnonzero(self.group == group)

    def groups(self) -> list[Indices]:
        """The members of each group, the largest group first."""
        order = np.argsort(self.group, kind="stable")
        found = np.split(order, np.flatnonzero(np.diff(self.group[order])) + 1)
        return sorted(found, key=lambda members: (-len(members), members[0]))

    def relative(self, target: int, source: int) -> Array:
        """``T_target_source`` (4, 4) of two views of one group."""
        pose: Array = se3.invert(self.poses[target]) @ self.poses[source]
        return pose

    def join(self, source: int, target: int, T_target_source: Array) -> None:
        """Move the group of view `source` into that of view `target`."""
        motion = self.poses[target] @ T_target_source @ se3.invert(self.poses[source])
        moving = self.members(int(self.group[source]))
        for k in moving:
            self.poses[k] = se3.project(motion @ self.poses[k])
        self.group[moving] = self.group[target]

    def leave(self, view: int) -> None:
        """Take a view out of its group, into one of its own."""
        taken = set(self.group.tolist())
        self.group[view] = next(g for g in range(len(self.views) + 1) if g not in taken)
        self.poses[view] = np.eye(4)

    def target(self, chosen: Sequence[int], pipeline: Pipeline) -> View:
        """The first of the `chosen` views of one group, merged with the others, in its frame.

        A view that is alone stays what it is. The parts of a model are all views of the group, so
        that evidence against a pose may come from any; its points are those of the chosen.
        """
        first = self.views[chosen[0]]
        group = self.members(int(self.group[chosen[0]])).tolist()
        if len(group) == 1:
            return first
        model = Model.of(first)
        for k in chosen[1:]:
            pose = self.relative(chosen[0], k)
            same = contact_points(self.views[k], model, pose)
            model = pipeline.augment(model, self.views[k], same)
        rest = [k for k in group if k not in chosen]
        poses = se3.invert(self.poses[chosen[0]]) @ np.array([self.poses[k] for k in rest]).reshape(
            -1, 4, 4
        )
        parts = (Part(self.views[k], pose) for k, pose in zip(rest, poses, strict=True))
        return replace(model, parts=(*model.parts, *parts))

    def view_pairs(self, sources: Sequence[int], targets: Sequence[int]) -> list[ViewPair]:
        """The pairs of views of one group that come near each other, each pair once.

        Of many that meet each other, those that `mvreg.surface.partners.well_spread` chooses.
        """
        known = [k for k in dict.fromkeys([*sources, *targets]) if len(self.views[k].points)]
        if not known:
            return []
        resolution, moving, staying = (
            self.views[known[0]].scale.resolution, set(sources), set(targets),
        )  # fmt: skip
        reach, found = 3 * resolution, list[ViewPair]()
        chosen = self.near_balls(known, moving, staying, reach)
        if not chosen:
            return []
        near = near_boxes(
            [np.stack(box(self.views[k].points, self.poses[k])) for k in chosen], reach
        )
        between = [
            (a, b) for a, b in near
            if (chosen[a] in moving and chosen[b] in staying)
            or (chosen[b] in moving and chosen[a] in staying)
        ]  # fmt: skip
        for a, b in well_spread(
            between, [self.views[k].points for k in chosen], [self.poses[k] for k in chosen],
            resolution,
        ):  # fmt: skip
            for i, j in ((chosen[a], chosen[b]), (chosen[b], chosen[a])):
                if i in moving and j in staying and (i not in staying or i < j):
                    pose = self.relative(j, i)
                    found.append(ViewPair(self.views[i], self.views[j], pose, self.poses[i]))
        return found

    def near_balls(
        self, views: Sequence[int], sources: Collection[int], targets: Collection[int], reach: float
    ) -> list[int]:
        """Those of one side that come near a view of the other, by balls about them."""
        balls = [ball(self.views[k]) for k in views]
        centres = np.array([
            self.poses[k][:3, :3] @ centre + self.poses[k][:3, 3]
            for k, (centre, _) in zip(views, balls, strict=True)
        ])  # fmt: skip
        radii = np.array([radius for _, radius in balls])
        sides = [np.array([k in side for k in views]) for side in (sources, targets)]
        if sides[0].all() and sides[1].all():
            return list(views)
        near = np.zeros(len(views), dtype=bool)
        for one, other in (sides, sides[::-1]):
            gaps = np.linalg.norm(centres[one][:, None] - centres[other], axis=2)
            near[one] |= (gaps <= radii[one][:, None] + radii[other] + reach).any(axis=1)
        return [k for k, meets in zip(views, near, strict=True) if meets]

    def incident_pairs(self, members: Sequence[int]) -> dict[int, list[ViewPair]]:
        """What each view of a group meets in it."""
        place = {id(self.views[k]): k for k in members}
        found: dict[int, list[ViewPair]] = {k: [] for k in members}
        for view_pair in self.view_pairs(members, members) if len(members) > 1 else ():
            found[place[id(view_pair.source)]].append(view_pair)
            found[place[id(view_pair.target)]].append(view_pair)
        return found


@kept_on_argument
def ball(view: View) -> tuple[Array, float]:
    """Centre (3,) and radius (length) of a ball around the points of a view."""
    low, high = view.points.min(axis=0), view.points.max(axis=0)
    centre: Array = (low + high) / 2
    return centre, float(np.sqrt(((view.points - centre) ** 2).sum(axis=1).max()))


def contact_points(source: View, target: View, T_target_source: Array) -> Registration:
    """A registration as it would be recorded for a given pose: what lies together is paired."""
    moved = se3.apply(T_target_source, source.points)
    distances, indices = nearest(target.tree, moved, SAME * source.scale.resolution)
    in_contact = np.flatnonzero(np.isfinite(distances))
    kept = distances[in_contact]
    mse = float((kept**2).mean()) if len(in_contact) else 0.0
    return Registration(
        source.name, target.name, T_target_source, len(in_contact) / max(len(moved), 1), mse, mse,
        np.stack([in_contact, indices[in_contact]], axis=1), kept, float(kept.max(initial=0.0)), 0,
        True,
    )  # fmt: skip


def pool_each(view_pairs: Sequence[ViewPair]) -> list[Evidence]:
    """Weigh every view pair by itself."""
    return in_threads(lambda view_pair: pool_evidence([view_pair]), view_pairs)
