"""The stages that come with mvreg, registered as any plugin's are."""

from __future__ import annotations

from mvreg.hookspecs import hookimpl


@hookimpl
def mvreg_stages() -> dict[str, type]:
    """Return the paper's stages, their variants, and the data sets."""
    from mvreg.datasets import folder, mixture, spoilt, stanford, synthetic
    from mvreg.stages import (
        adjust,
        augment,
        describe,
        downsample,
        downsample_grid,
        joint,
        jrmpc,
        judge,
        judge_evidence,
        lrs,
        motion_averaging,
        propagate,
        refine,
        refine_planes,
        seed,
        strategy,
        strategy_best_first,
        strategy_coarse_to_fine,
        strategy_sequential,
    )

    return {
        "dataset/stanford": stanford.Stanford,
        "dataset/folder": folder.Folder,
        "dataset/figurine": synthetic.Figurine,
        "dataset/tiny": synthetic.Tiny,
        "dataset/mixture": mixture.Mixture,
        "dataset/spoilt": spoilt.Spoilt,
        "downsample/paper": downsample.PaperDownsample,
        "downsample/stride": downsample.StrideDownsample,
        "downsample/voxel": downsample.VoxelDownsample,
        "downsample/grid": downsample_grid.GridDownsample,
        "describe/spectrum": describe.SpectrumDescribe,
        "describe/eigenvalues": describe.EigenvaluesDescribe,
        "describe/none": describe.NoDescribe,
        "seed/nearest": seed.NearestSeed,
        "propagate/consensus": propagate.ConsensusPropagate,
        "refine/tricp": refine.TrimmedICP,
        "refine/icp": refine.ICP,
        "refine/fractional_icp": refine.FractionalICP,
        "refine/point_to_plane": refine_planes.PointToPlane,
        "refine/symmetric": refine_planes.SymmetricICP,
        "refine/gicp": refine_planes.GeneralizedICP,
        "judge/tmse": judge.TmseJudge,
        "judge/tmse_surface": judge.TmseSurfaceJudge,
        "judge/point_to_plane": judge.PointToPlaneJudge,
        "judge/evidence": judge_evidence.EvidenceJudge,
        "augment/concat": augment.ConcatAugment,
        "augment/merge": augment.MergeAugment,
        "strategy/grow": strategy.GrowStrategy,
        "strategy/best_first": strategy_best_first.BestFirst,
        "strategy/sequential": strategy_sequential.SequentialStrategy,
        "strategy/coarse_to_fine": strategy_coarse_to_fine.CoarseToFineStrategy,
        "adjust/none": adjust.NoAdjust,
        "adjust/motion_averaging": motion_averaging.MotionAveraging,
        "adjust/weighted_motion_averaging": motion_averaging.WeightedMotionAveraging,
        "adjust/lrs": lrs.LowRankSparse,
        "adjust/jrmpc": jrmpc.JointMixture,
        "adjust/joint": joint.JointRefinement,
    }
