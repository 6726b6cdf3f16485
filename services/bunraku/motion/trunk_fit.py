"""Fit of the figure's trunk: root, sacroiliac, vl5 and skullbase."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bunraku.motion import procrustes, rotation
from bunraku.motion.fit import FigureFit
from bunraku.motion.joint_rule import Aim, JointRule, NearestPoints
from bunraku.motion.joint_tree import ancestor_chain, common_ancestor
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

CROWN_OFFSET_M = 0.20
"""Distance from skullbase to the crown, where the codec's error is measured."""
NECK_LENGTH_M = 0.12
"""Distance from the middle of the shoulders to the skullbase, for a source without head."""
CHEST_POINT_WEIGHTS: Array = np.array([1.0, 2.0, 2.0])
"""Weights of skullbase and shoulders: a shoulder carries an arm."""
MIN_IMPROVEMENT_M = 1e-4
"""Smallest gain for which a more complex solution is preferred."""
MAX_SAMPLED_FRAMES = 200

HIPS = ("l_hip", "r_hip")
SHOULDERS = ("l_shoulder", "r_shoulder")


def fit_trunk(fit: FigureFit) -> None:
    """Place root, sacroiliac, vl5 and skullbase, and set the offsets of hips and shoulders."""
    fit.place_joint(0, np.zeros(3), JointRule(source=fit.joints[0]))
    _fit_pelvis(fit)
    _fit_chest(fit)
    _fit_head(fit)


def _fit_pelvis(fit: FigureFit) -> None:
    """Place the sacroiliac at the source's pelvis or at the root; if the hips move in it, rotate it with their axis."""
    pelvis = JOINT_INDEX["sacroiliac"]
    source = fit.joints.get(pelvis)
    rule = JointRule(copied=0) if source is None else JointRule(source=source)
    fit.place_joint(pelvis, np.zeros(3) if source is None else fit.mean_offset(0, source), rule)
    sources = [fit.joints[JOINT_INDEX[name]] for name in HIPS]
    hips = fit.relative_positions(pelvis, sources)
    places = procrustes.mean_local_positions(fit.joint_orientations[:, pelvis], hips)
    if procrustes.rms_error(fit.joint_orientations[:, pelvis], places, hips, np.ones(2)) > MIN_IMPROVEMENT_M:
        aim = Aim(places[0] - places[1], target=sources[0], start=sources[1])
        fit.place_joint(pelvis, fit.offsets[pelvis].copy(), replace(rule, aim=aim))
        places = procrustes.mean_local_positions(fit.joint_orientations[:, pelvis], hips)
    for name, place in zip(HIPS, places, strict=True):
        fit.offsets[JOINT_INDEX[name]] = place


@dataclass(frozen=True, slots=True)
class _ChestCandidate:
    """Candidate for vl5: position of one source joint, orientation of another (None: solved), local points (m, 3)."""

    error: float
    position_joint: int
    orientation_joint: int | None
    local_positions: Array


def _fit_chest(fit: FigureFit) -> None:
    """Place vl5 at the position in the source's spine and with the orientation (a joint's or solved) that fit best."""
    vl5 = JOINT_INDEX["vl5"]
    carried = [JOINT_INDEX[name] for name in ("skullbase", *SHOULDERS) if JOINT_INDEX[name] in fit.joints]
    sources = [fit.joints[joint] for joint in carried]
    weights = CHEST_POINT_WEIGHTS[-len(carried) :]
    root = fit.joints[0]
    above = ancestor_chain(fit.source.parents, root)
    shoulder_chain = ancestor_chain(
        fit.source.parents, common_ancestor(fit.source.parents, [fit.joints[JOINT_INDEX[name]] for name in SHOULDERS])
    )
    spine = [joint for joint in reversed(shoulder_chain) if joint not in above] or [root]
    chosen = _select_chest(fit, spine, sources, weights)
    if chosen.position_joint != root:
        fit.joints[vl5] = chosen.position_joint
    rule = (
        JointRule(source=chosen.orientation_joint)
        if chosen.orientation_joint is not None
        else JointRule(nearest=NearestPoints(chosen.local_positions, tuple(sources), weights))
    )
    fit.place_joint(vl5, fit.mean_offset(0, chosen.position_joint), rule)
    targets = fit.relative_positions(vl5, sources)
    for joint, place in zip(
        carried, procrustes.mean_local_positions(fit.joint_orientations[:, vl5], targets), strict=True
    ):
        fit.offsets[joint] = place


def _select_chest(fit: FigureFit, spine: list[int], sources: list[int], weights: Array) -> _ChestCandidate:
    """Try every position and orientation on a sample of frames; the first of equal results is kept."""
    few = np.unique(np.linspace(0, len(fit.position) - 1, MAX_SAMPLED_FRAMES).astype(np.int64))
    choices: list[_ChestCandidate] = []
    for source in spine:
        placed = fit.joint_positions[few, 0] + rotation.rotate(
            fit.joint_orientations[few, 0], fit.mean_offset(0, source)
        )
        own = float(np.sqrt(np.mean(np.sum((placed - fit.position[few, source]) ** 2, axis=-1))))
        targets = fit.position[few][:, sources] - placed[:, None]
        for turned in (*spine, None):
            if turned is None:
                rested = fit.rest_positions[sources] - fit.rest_positions[source]
                places = procrustes.fit_local_positions(fit.turn[few, spine[-1]], targets, weights, rested)
                orientation = procrustes.solve_kabsch(places, targets, weights)
            else:
                orientation = fit.turn[few, turned]
                places = procrustes.mean_local_positions(orientation, targets)
            error = procrustes.rms_error(orientation, places, targets, weights) + own / weights.sum()
            choices.append(_ChestCandidate(error, source, turned, places))
    least = min(choice.error for choice in choices)
    return next(choice for choice in choices if choice.error <= least + MIN_IMPROVEMENT_M)


def _fit_head(fit: FigureFit) -> None:
    head, vl5 = JOINT_INDEX["skullbase"], JOINT_INDEX["vl5"]
    source = fit.joints.get(head)
    if source is None:
        middle = fit.offsets[[JOINT_INDEX[name] for name in SHOULDERS]].mean(axis=0)
        fit.place_joint(head, middle + np.array([0.0, NECK_LENGTH_M, 0.0]), JointRule(copied=vl5))
    else:
        fit.place_joint(head, fit.offsets[head], JointRule(source=source))
    fit.tips[head] = (0.0, CROWN_OFFSET_M, 0.0)
