"""Animation of a score: trunk, head and arms from pose to pose, over legs that carry the weight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bunraku.demo import balance, footwork, stance, two_bone_ik
from bunraku.demo.score import SIDES, Arm, Pose, Score, Side
from bunraku.motion import easing, rotation
from bunraku.motion.easing import EasedMove
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, Figure, Motion

HEAD_LEAD_S, SHOULDER_LEAD_S, ELBOW_LAG_S, WRIST_LAG_S = 0.06, 0.03, 0.03, 0.09
"""Offsets of body parts from their beat: the head leads, the hand follows."""
TURN_ANTICIPATION_S = 0.3
"""Time by which the head anticipates a turn of the hips."""
MAX_HEAD_LEAD_RAD = np.radians(40.0)
"""Largest angle by which the head then leads the hips."""
BREATH_COUNT = 6
"""Breaths per loop, a whole number so that the loop closes."""
_SHOULDER_NEUTRAL: Array = np.array([-0.8, 0.0, 0.8])
"""Rotation vector of a left arm held forward and out, the middle of its range.

Arms are blended as rotation vectors relative to it, so that none comes near half a turn, where such a vector jumps.
"""
_MIRROR_SIGNS: dict[Side, Array] = {"left": np.array([1.0, 1.0, 1.0]), "right": np.array([1.0, -1.0, -1.0])}


def animate(score: Score, figure: Figure, fps: float) -> Motion:
    """Return the motion of `score` for `figure` at `fps` frames per second; its end leads to its start."""
    time = np.arange(round(score.duration * fps)) / fps
    rotations = np.tile(rotation.IDENTITY, (len(time), JOINT_COUNT, 1))
    _animate_trunk(score, time, rotations)
    for side in SIDES:
        _animate_arm(score, figure, time, side, rotations)
    feet = {side: footwork.animate_foot(score, figure, side, time) for side in SIDES}
    height = figure.offsets[0, 1] - _hip_drop(score, time) + balance.hop_height(score, time)
    facing, weight = balance.hip_facing(score, time), balance.weight_target(score, time)
    root = stance.solve_stance(figure, rotations, feet, facing, height, weight)
    return Motion(figure, fps, root, rotations)


def _interpolate_keys(score: Score, time: Array, extract: Callable[[Pose], Array]) -> Array:
    """Interpolate the values (k,) that `extract` returns for each pose over `time` (n,): (n, k)."""
    beat = score.seconds_per_beat
    start = now = extract(score.rest_pose)
    moves = []
    for key in score.keys:
        to = extract(key.pose)
        ease = easing.minimum_jerk if key.is_smooth else easing.ease_out
        moves.append(EasedMove((key.beat - key.transition_beats) * beat, key.transition_beats * beat, to - now, ease))
        now = to
    return easing.superpose(time, start, moves)


def _stamp_shock(score: Score, time: Array) -> Array:
    """Return the shock of the stamps to the body (n,), 0 to 1 and back at each."""
    shock = np.zeros_like(time)
    for step in score.steps:
        if step.is_stamp:
            landing = step.beat * score.seconds_per_beat
            shock += easing.bump(time, landing - 0.03, landing + 0.06, landing + 0.4)
    return shock


def _hip_drop(score: Score, time: Array) -> Array:
    """Return the depth (n,) in metres of the hips below standing."""
    depth: Array = _interpolate_keys(score, time + SHOULDER_LEAD_S, lambda pose: np.array([pose.depth]))[:, 0]
    return depth + 0.012 * _stamp_shock(score, time)


def _animate_trunk(score: Score, time: Array, rotations: Array) -> None:
    """Set root, sacroiliac, vl5 and skullbase in `rotations`."""
    facing = balance.hip_facing(score, time)
    trunk = _interpolate_keys(score, time + SHOULDER_LEAD_S, lambda pose: np.radians([pose.bow, pose.lean, pose.twist]))
    head = _interpolate_keys(score, time + HEAD_LEAD_S, lambda pose: np.radians([pose.look, pose.nod, pose.tilt]))
    bow, lean, twist = trunk.T
    look, nod, tilt = head.T
    breath = np.sin(2.0 * np.pi * BREATH_COUNT * time / score.duration)
    bow = bow + np.radians(0.8) * breath
    nod = nod + np.radians(3.0) * _stamp_shock(score, time)
    look = look + MAX_HEAD_LEAD_RAD * np.tanh(
        (balance.hip_facing(score, time + TURN_ANTICIPATION_S) - facing) / MAX_HEAD_LEAD_RAD
    )
    rotations[:, 0] = _rotation_yxz(facing, 0.4 * bow, -0.3 * lean)
    rotations[:, JOINT_INDEX["sacroiliac"]] = _rotation_yxz(0.2 * twist, -0.15 * bow, 0.0 * lean)
    rotations[:, JOINT_INDEX["vl5"]] = _rotation_yxz(twist, 0.6 * bow, -0.7 * lean)
    rotations[:, JOINT_INDEX["skullbase"]] = _rotation_yxz(look - twist, nod, -tilt)


def _rotation_yxz(y: Array, x: Array, z: Array) -> Array:
    """Return rotations (n, 4) about z, then x, then y, by angles (n,) in radians."""
    about = rotation.from_coordinate_axis
    return rotation.multiply(rotation.multiply(about(1, y), about(0, x)), about(2, z))


def _animate_arm(score: Score, figure: Figure, time: Array, side: Side, rotations: Array) -> None:
    """Set shoulder, elbow and wrist of one side in `rotations`; the arm of each pose is solved once."""
    arms = {pose: getattr(pose, side) for pose in (score.rest_pose, *(key.pose for key in score.keys))}
    solved = {pose: solve_arm(figure, arm) for pose, arm in arms.items()}
    shoulder = _interpolate_keys(score, time + SHOULDER_LEAD_S, lambda pose: solved[pose][:3])
    elbow = _interpolate_keys(score, time - ELBOW_LAG_S, lambda pose: solved[pose][3:4])[:, 0]
    wrist = _interpolate_keys(score, time - WRIST_LAG_S, lambda pose: solved[pose][4:])
    from_vector, mirror = rotation.from_rotation_vector, _MIRROR_SIGNS[side]
    rotations[:, JOINT_INDEX[f"{side[0]}_shoulder"]] = rotation.multiply(
        from_vector(_SHOULDER_NEUTRAL * mirror), from_vector(shoulder * mirror)
    )
    rotations[:, JOINT_INDEX[f"{side[0]}_elbow"]] = rotation.from_coordinate_axis(0, -np.clip(elbow, 0.0, None))
    rotations[:, JOINT_INDEX[f"{side[0]}_wrist"]] = from_vector(wrist * mirror)


def solve_arm(figure: Figure, arm: Arm) -> Array:
    """Return a left arm (7,) in radians: shoulder (rotation vector from neutral), elbow bend, wrist (rotation
    vector)."""
    upper, lower = figure.offsets[JOINT_INDEX["l_elbow"]], figure.offsets[JOINT_INDEX["l_wrist"]]
    target = np.array([arm.wrist_position]) * two_bone_ik.end_distance(upper, lower)
    turned, bend = two_bone_ik.solve_two_bone(
        upper, lower, target, np.array([arm.elbow_direction]), two_bone_ik.ELBOW_SIGN
    )
    middle = rotation.from_rotation_vector(_SHOULDER_NEUTRAL)
    shoulder = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(middle), turned[0]))
    about = rotation.from_coordinate_axis
    hand = rotation.multiply(about(1, np.radians(arm.palm_turn)), about(2, np.radians(-arm.hand_bend)))
    return np.concatenate([shoulder, bend, rotation.to_rotation_vector(hand)])
