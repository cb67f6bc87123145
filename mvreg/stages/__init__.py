"""The built-in stages, to compose by hand or to subclass.

Public are the names below; the modules of this package may change.
"""

from typing import TYPE_CHECKING

from mvreg._lazy import looked_up

if TYPE_CHECKING:
    from mvreg.stages.adjust.joint.stage import JointRefinement as JointRefinement
    from mvreg.stages.adjust.jrmpc.stage import JointMixture as JointMixture
    from mvreg.stages.adjust.lrs.stage import LowRankSparse as LowRankSparse
    from mvreg.stages.adjust.motion_averaging import MotionAveraging as MotionAveraging
    from mvreg.stages.adjust.motion_averaging import (
        WeightedMotionAveraging as WeightedMotionAveraging,
    )
    from mvreg.stages.adjust.none import NoAdjust as NoAdjust
    from mvreg.stages.augment.merge import ConcatAugment as ConcatAugment
    from mvreg.stages.augment.merge import MergeAugment as MergeAugment
    from mvreg.stages.describe.spectrum import EigenvaluesDescribe as EigenvaluesDescribe
    from mvreg.stages.describe.spectrum import NoDescribe as NoDescribe
    from mvreg.stages.describe.spectrum import SpectrumDescribe as SpectrumDescribe
    from mvreg.stages.downsample.grid import GridDownsample as GridDownsample
    from mvreg.stages.downsample.sampling import PaperDownsample as PaperDownsample
    from mvreg.stages.downsample.sampling import StrideDownsample as StrideDownsample
    from mvreg.stages.downsample.sampling import VoxelDownsample as VoxelDownsample
    from mvreg.stages.judge.evidence import EvidenceJudge as EvidenceJudge
    from mvreg.stages.judge.residual import PointToPlaneJudge as PointToPlaneJudge
    from mvreg.stages.judge.residual import ResidualJudge as ResidualJudge
    from mvreg.stages.judge.residual import TmseJudge as TmseJudge
    from mvreg.stages.judge.residual import TmseSurfaceJudge as TmseSurfaceJudge
    from mvreg.stages.propagate.consensus import ConsensusPropagate as ConsensusPropagate
    from mvreg.stages.refine.planes import GeneralizedICP as GeneralizedICP
    from mvreg.stages.refine.planes import PointToPlane as PointToPlane
    from mvreg.stages.refine.planes import SymmetricICP as SymmetricICP
    from mvreg.stages.refine.trimmed import ICP as ICP
    from mvreg.stages.refine.trimmed import FractionalICP as FractionalICP
    from mvreg.stages.refine.trimmed import TrimmedICP as TrimmedICP
    from mvreg.stages.seed.nearest import NearestSeed as NearestSeed
    from mvreg.stages.strategy.best_first.strategy import BestFirst as BestFirst
    from mvreg.stages.strategy.coarse_to_fine import CoarseToFineStrategy as CoarseToFineStrategy
    from mvreg.stages.strategy.grow import GrowStrategy as GrowStrategy
    from mvreg.stages.strategy.sequential import SequentialStrategy as SequentialStrategy

_WHERE = {
    "BestFirst": "strategy.best_first.strategy",
    "CoarseToFineStrategy": "strategy.coarse_to_fine",
    "ConcatAugment": "augment.merge",
    "ConsensusPropagate": "propagate.consensus",
    "EigenvaluesDescribe": "describe.spectrum",
    "EvidenceJudge": "judge.evidence",
    "FractionalICP": "refine.trimmed",
    "GeneralizedICP": "refine.planes",
    "GridDownsample": "downsample.grid",
    "GrowStrategy": "strategy.grow",
    "ICP": "refine.trimmed",
    "JointMixture": "adjust.jrmpc.stage",
    "JointRefinement": "adjust.joint.stage",
    "LowRankSparse": "adjust.lrs.stage",
    "MergeAugment": "augment.merge",
    "MotionAveraging": "adjust.motion_averaging",
    "NearestSeed": "seed.nearest",
    "NoAdjust": "adjust.none",
    "NoDescribe": "describe.spectrum",
    "PaperDownsample": "downsample.sampling",
    "PointToPlane": "refine.planes",
    "PointToPlaneJudge": "judge.residual",
    "ResidualJudge": "judge.residual",
    "SequentialStrategy": "strategy.sequential",
    "SpectrumDescribe": "describe.spectrum",
    "StrideDownsample": "downsample.sampling",
    "SymmetricICP": "refine.planes",
    "TmseJudge": "judge.residual",
    "TmseSurfaceJudge": "judge.residual",
    "TrimmedICP": "refine.trimmed",
    "VoxelDownsample": "downsample.sampling",
    "WeightedMotionAveraging": "adjust.motion_averaging",
}

__all__ = sorted(_WHERE)
__getattr__, __dir__ = looked_up(__name__, _WHERE)
