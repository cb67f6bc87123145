"""How an accepted scan comes into the model: ``augment=nameless``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry import Indices, se3
from mvreg.geometry.nearest import mean_spacing, nearest
from mvreg.types import Features, Model, Part, Registration, View


@dataclass(frozen=True)
class NamelessAugment:
    """Add what is new, and keep what the model has: of two points of one place the older stays."""

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a source into the model, whose frame stays.

        Returns
        -------
        Model
            The model's points and keypoints, then those of the source that have no partner there.
        """
        pose = registration.T_target_source
        turn = pose[:3, :3].T
        new = np.setdiff1d(np.arange(len(source.points)), registration.pairs[:, 0])
        points = np.concatenate([model.points, se3.apply(pose, source.points[new])])
        return Model(
            model.name,
            points,
            np.concatenate([model.normals, source.normals[new] @ turn]),
            self.features(model, source, registration),
            mean_spacing(points),
            model.scale,
            parts=(*model.parts, Part(source, pose)),
        )

    def features(self, model: Model, source: View, registration: Registration) -> Features:
        """The keypoints of both, without those of the source that are near one of the model's."""
        own, other, pose = model.features, source.features, registration.T_target_source
        there = se3.apply(pose, other.keypoints)
        distances, _ = nearest(model.keypoint_tree, there, registration.trim_distance or 1e-300)
        new: Indices = np.flatnonzero(~np.isfinite(distances))
        return Features(
            np.concatenate([own.keypoints, there[new]]),
            np.concatenate([own.normals, other.normals[new] @ pose[:3, :3].T]),
            np.concatenate([own.descriptors, other.descriptors[new]]),
            own.oriented and other.oriented,
            own.spread if own.spread == other.spread else None,
        )
