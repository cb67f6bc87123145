"""Errors of poses against ground truth, and consistency of the surfaces without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.surface.consistency import Consistency as Consistency
from mvreg.surface.consistency import consistency as consistency
from mvreg.types import Array, Result, ScanSet


@dataclass(frozen=True)
class ScanError:
    """How far one pose is from its truth.

    `rotation` is the Frobenius norm of the rotations' difference, `angle` the same in degrees,
    `translation` the 2-norm of the translations' difference (length).
    """

    rotation: float
    angle: float
    translation: float


@dataclass(frozen=True)
class PoseErrors:
    """The errors of the placed scans that have a truth, in the frame of the scan `frame`."""

    frame: str
    scans: Mapping[str, ScanError]

    @property
    def mean(self) -> ScanError:
        """Mean over the scans, the scan of the frame (error zero) included: e_R and e_t."""
        return ScanError(*(float(x) for x in self._table().mean(axis=0)))

    @property
    def max(self) -> ScanError:
        """The largest of each error."""
        return ScanError(*(float(x) for x in self._table().max(axis=0)))

    def _table(self) -> Array:
        return np.array([(e.rotation, e.angle, e.translation) for e in self.scans.values()])


def pose_errors(
    poses: Mapping[str, Array], truth: Mapping[str, Array] | None, reference: str
) -> PoseErrors | None:
    """Compare poses with the truth as the paper does, e_R and e_t.

    Both are re-based to the frame of one scan, ``M'_i = M_ref^-1 M_i``, because the truth's own
    frame is arbitrary. That scan is the reference; where the reference has no truth, it is the
    first placed scan that has (`PoseErrors.frame` names it), so that a partial truth still counts.
    The means include that scan, whose error is zero, as the paper's do.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan`` of the placed scans.
    truth : mapping of scan name to (4, 4) array, or None
        ``T_world_scan``; may miss scans.
    reference : str
        The scan whose frame is the model frame.

    Returns
    -------
    PoseErrors or None
        None where fewer than two placed scans have a truth: there is nothing to compare, and a
        mean of zero would look like a perfect answer.
    """
    known = [name for name in poses if truth is not None and name in truth]
    if truth is None or len(known) < 2:
        return None
    frame = reference if reference in known else known[0]
    found = se3.invert(poses[frame]) @ np.stack([poses[name] for name in known])
    right = se3.invert(truth[frame]) @ np.stack([truth[name] for name in known])
    rotations = np.linalg.norm((found - right)[:, :3, :3], axis=(1, 2))
    angles = np.degrees(se3.rotation_angle(found, right))
    translations = np.linalg.norm((found - right)[:, :3, 3], axis=1)
    rows = zip(rotations.tolist(), angles.tolist(), translations.tolist(), strict=True)
    return PoseErrors(frame, {name: ScanError(*row) for name, row in zip(known, rows, strict=True)})


def result_errors(
    result: Result, scanset: ScanSet
) -> tuple[PoseErrors | None, list[PoseErrors | None]]:
    """The errors of a result, and those of its components, each in a frame of its own.

    How a partial model lies to the reference's is not known, and does not count; a scan in a wrong
    place within it does. Scans are compared with those of the same object as the first one, and in
    the frames that they were read in: how far from a surface its frame lies decides how large an
    error of translation an error of rotation makes.
    """

    def errors(poses: Mapping[str, Array], first: str) -> PoseErrors | None:
        truth = scanset.truth_beside(first)
        right = None if truth is None else scanset.as_read(truth)
        return pose_errors(scanset.as_read(poses), right, first)

    apart = [errors(poses, next(iter(poses), "")) for poses in result.components]
    return errors(result.poses, result.reference), apart
