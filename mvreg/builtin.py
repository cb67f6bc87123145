"""The stages that come with mvreg, registered as any plugin's are."""

from __future__ import annotations

from mvreg.plugins.hookspecs import hookimpl


@hookimpl
def mvreg_stages() -> dict[str, type]:
    """Return the paper's stages, their variants, and the data sets."""
    from mvreg.datasets import folder, mixture, spoilt, stanford, synthetic
    from mvreg.datasets.environments import sets
    from mvreg.stages.adjust import motion_averaging, none
    from mvreg.stages.adjust.joint.stage import JointRefinement
    from mvreg.stages.adjust.jrmpc.stage import JointMixture
    from mvreg.stages.adjust.lrs.stage import LowRankSparse
    from mvreg.stages.augment import merge
    from mvreg.stages.describe import spectrum
    from mvreg.stages.downsample import grid, sampling
    from mvreg.stages.judge import evidence, residual
    from mvreg.stages.propagate import consensus
    from mvreg.stages.refine import planes, trimmed
    from mvreg.stages.seed import nearest
    from mvreg.stages.strategy import coarse_to_fine, grow, sequential
    from mvreg.stages.strategy.best_first.strategy import BestFirst

    return {
        "dataset/stanford": stanford.Stanford,
        "dataset/folder": folder.Folder,
        "dataset/figurine": synthetic.Figurine,
        "dataset/tiny": synthetic.Tiny,
        "dataset/room": sets.Room,
        "dataset/office": sets.Office,
        "dataset/yard": sets.Yard,
        "dataset/street": sets.Street,
        "dataset/desk": sets.Desk,
        "dataset/mixture": mixture.Mixture,
        "dataset/spoilt": spoilt.Spoilt,
        "downsample/paper": sampling.PaperDownsample,
        "downsample/stride": sampling.StrideDownsample,
        "downsample/voxel": sampling.VoxelDownsample,
        "downsample/grid": grid.GridDownsample,
        "describe/spectrum": spectrum.SpectrumDescribe,
        "describe/eigenvalues": spectrum.EigenvaluesDescribe,
        "describe/none": spectrum.NoDescribe,
        "seed/nearest": nearest.NearestSeed,
        "propagate/consensus": consensus.ConsensusPropagate,
        "refine/tricp": trimmed.TrimmedICP,
        "refine/icp": trimmed.ICP,
        "refine/fractional_icp": trimmed.FractionalICP,
        "refine/point_to_plane": planes.PointToPlane,
        "refine/symmetric": planes.SymmetricICP,
        "refine/gicp": planes.GeneralizedICP,
        "judge/tmse": residual.TmseJudge,
        "judge/tmse_surface": residual.TmseSurfaceJudge,
        "judge/point_to_plane": residual.PointToPlaneJudge,
        "judge/evidence": evidence.EvidenceJudge,
        "augment/concat": merge.ConcatAugment,
        "augment/merge": merge.MergeAugment,
        "strategy/grow": grow.GrowStrategy,
        "strategy/best_first": BestFirst,
        "strategy/sequential": sequential.SequentialStrategy,
        "strategy/coarse_to_fine": coarse_to_fine.CoarseToFineStrategy,
        "adjust/none": none.NoAdjust,
        "adjust/motion_averaging": motion_averaging.MotionAveraging,
        "adjust/weighted_motion_averaging": motion_averaging.WeightedMotionAveraging,
        "adjust/lrs": LowRankSparse,
        "adjust/jrmpc": JointMixture,
        "adjust/joint": JointRefinement,
    }


@hookimpl
def mvreg_suites() -> dict[str, type]:
    """Return the suites of stages whose defaults are not for the suites' small scans."""
    from mvreg.testing.core import core_suites

    return core_suites()
