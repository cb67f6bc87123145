"""A second look at an attempt that was refused: what evidence says of every pose that it found.

Candidates are ranked by what refinement minimises, which a corridor or a low overlap misleads: a
collapsed pose lets more points meet. Free space and normals tell such a pose from the right one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mvreg.contracts import Judge, Pipeline
from mvreg.evidence.pairing import on_few_points, view_pairs
from mvreg.parallel import in_threads
from mvreg.stages.strategy.best_first.hypotheses import LEAST_PROBABILITY, distinct, shares
from mvreg.stages.strategy.best_first.joint_verdict import Together, together
from mvreg.stages.strategy.best_first.other_side import other_side
from mvreg.stages.strategy.best_first.symmetry import symmetry_hypotheses
from mvreg.surface.displacement import rms_apart
from mvreg.types import Answer, Array, Pair, Registration, View

#: So many alternatives, the most probable ones on few points, are refined on all of them.
MOST = 3
#: What is less probable on few points is not asked on more.
HOPELESS = 0.03


def weighed(judge: Judge, source: View, target: View, T_target_source: Array) -> Together:
    """What is said of a pose by itself."""
    return together(judge, view_pairs(source, target, T_target_source))


def rough_probability(judge: Judge, source: View, target: View, T_target_source: Array) -> float:
    """How probable a pose is by itself, on few points, or on more if it may be."""
    for pairs in on_few_points(source, target, T_target_source):
        found = together(judge, pairs).probability
        if found < HOPELESS:
            break
    return found


def with_answers(
    pair: Pair,
    source: View,
    found: Sequence[Registration],
    probabilities: Sequence[float],
    plausibilities: Sequence[float],
) -> Pair:
    """The record of a refused attempt with the poses that may be right, if there are several."""
    said = shares(probabilities, plausibilities)
    order = [int(k) for k in np.argsort(-said, kind="stable") if said[k] >= LEAST_PROBABILITY]
    if pair.verdict.reliable or len(order) < 2:
        return pair
    poses = [found[k].T_target_source for k in order]
    answers = tuple(
        Answer(pose, min(float(said[k]), 1.0), rms_apart(source.points, pose, poses[0]))
        for k, pose in zip(order, poses, strict=True)
    )
    return replace(pair, answers=answers)


def looked_at_again(
    pipeline: Pipeline, registration: Registration, source: View, target: View
) -> tuple[list[Registration], list[float], list[float]]:
    """The poses of an attempt that may be right, refined, and how probable each is by itself.

    Parameters
    ----------
    pipeline : Pipeline
    registration : Registration
        What was refused, with its alternatives.
    source, target : View

    Returns
    -------
    found : list of Registration
        That of the attempt first; then others, and those that a symmetry of the most plausible of
        them allows. They differ.
    probabilities : list of float
    plausibilities : list of float
        The same, whether or not a pose can slide: what can slide is a rival of what cannot.
    """
    judge, refine = pipeline.judge, pipeline.refine

    def rough(pose: Array) -> float:
        return rough_probability(judge, source, target, pose)

    poses = [registration.T_target_source, *registration.alternatives]
    others = [poses[k] for k in distinct(source, poses)[1:]]
    first = np.array(in_threads(rough, others))
    order = [k for k in np.argsort(-first, kind="stable")[:MOST] if first[k] >= LEAST_PROBABILITY]
    found = [registration, *(refine(source, target, others[k]) for k in order)]
    said = [weighed(judge, source, target, one.T_target_source) for one in found]
    # What slid along a facade or a corridor leads to the right pose, which does not slide.
    best = int(np.argmax([one.plausibility for one in said]))
    if said[best].plausibility >= LEAST_PROBABILITY:
        alike = symmetry_hypotheses(found[best], source, target, refine)
        found += [replace(found[best], T_target_source=pose) for pose in alike]
        said += [weighed(judge, source, target, pose) for pose in alike]
    kept = distinct(source, [one.T_target_source for one in found])
    same = [1 - other_side(found[k], source, target) if said[k].probability else 1.0 for k in kept]
    return (
        [found[k] for k in kept],
        [said[k].probability * share for k, share in zip(kept, same, strict=True)],
        [said[k].plausibility for k in kept],
    )
