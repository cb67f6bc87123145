"""Partial models: which views are joined, and their relative poses."""

from __future__ import annotations

from collections.abc import Sequence
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
        rest = [Part(self.views[k], self.relative(chosen[0], k)) for k in group if k not in chosen]
        return replace(model, parts=(*model.parts, *rest))

    def view_pairs(self, sources: Sequence[int], targets: Sequence[int]) -> list[ViewPair]:
        """The pairs of views of one group that come near each other, each pair once.

        Of many that meet each other, those that `mvreg.surface.partners.well_spread` chooses.
        """
        chosen = [k for k in dict.fromkeys([*sources, *targets]) if len(self.views[k].points)]
        if not chosen:
            return []
        moving, staying = set(sources), set(targets)
        reach = 3 * self.views[chosen[0]].scale.resolution
        found = []
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
            self.views[chosen[0]].scale.resolution,
        ):  # fmt: skip
            for i, j in ((chosen[a], chosen[b]), (chosen[b], chosen[a])):
                if i in moving and j in staying and (i not in staying or i < j):
                    pose = self.relative(j, i)
                    found.append(ViewPair(self.views[i], self.views[j], pose, self.poses[i]))
        return found

    def incident_pairs(self, members: Sequence[int]) -> dict[int, list[ViewPair]]:
        """What each view of a group meets in it."""
        place = {id(self.views[k]): k for k in members}
        found: dict[int, list[ViewPair]] = {k: [] for k in members}
        for view_pair in self.view_pairs(members, members) if len(members) > 1 else ():
            found[place[id(view_pair.source)]].append(view_pair)
            found[place[id(view_pair.target)]].append(view_pair)
        return found


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
