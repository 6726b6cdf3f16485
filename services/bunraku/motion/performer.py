"""The body that performs a score: trunk, head and arms from pose to pose, over legs that carry the weight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bunraku.motion import balance, easing, footwork, legs, rotation, two_bone
from bunraku.motion.easing import Move
from bunraku.motion.rotation import Array
from bunraku.motion.score import SIDES, Arm, Pose, Score, Side
from bunraku.motion.skeleton import INDEX, JOINT_COUNT, Figure, Motion

HEAD_LEAD, SHOULDER_LEAD, ELBOW_LAG, WRIST_LAG = 0.06, 0.03, 0.03, 0.09
"""Seconds by which parts set out before or after their beat: the head leads, the hand is drawn along."""
TURN_LEAD = 0.3
"""Seconds by which the head sees a turn of the hips coming."""
NECK = np.radians(40.0)
"""The most by which it then turns ahead of them."""
BREATHS = 6
"""Breaths in one dance, a whole number so that it closes."""
_SHOULDER_MIDDLE: Array = np.array([-0.8, 0.0, 0.8])
"""Rotation vector of a left arm held forward and out, the middle of its range. Arms are blended as rotation vectors
from here, so that none comes near the half turn where such a vector jumps."""
_MIRROR: dict[Side, Array] = {"left": np.array([1.0, 1.0, 1.0]), "right": np.array([1.0, -1.0, -1.0])}


def perform(score: Score, figure: Figure, fps: float) -> Motion:
    """The motion of `score` danced by `figure` at `fps` frames a second; its end leads on to its beginning."""
    time = np.arange(round(score.duration * fps)) / fps
    rotations = np.tile(rotation.IDENTITY, (len(time), JOINT_COUNT, 1))
    _trunk(score, time, rotations)
    for side in SIDES:
        _arm(score, figure, time, side, rotations)
    feet = {side: footwork.foot(score, figure, side, time) for side in SIDES}
    height = figure.offsets[0, 1] - _depth(score, time) + balance.leap(score, time)
    facing, weight = balance.facing(score, time), balance.weight(score, time)
    root = legs.stand(figure, rotations, feet, facing, height, weight)
    return Motion(figure, fps, root, rotations)


def _track(score: Score, time: Array, value: Callable[[Pose], Array]) -> Array:
    """What `value` says of a pose (k,), from key to key over `time` (n,): (n, k)."""
    beat = score.seconds_per_beat
    start = now = value(score.rest)
    moves = []
    for key in score.keys:
        to = value(key.pose)
        ease = easing.minimum_jerk if key.even else easing.crisp
        moves.append(Move((key.beat - key.over) * beat, key.over * beat, to - now, ease))
        now = to
    return easing.superpose(time, start, moves)


def _shock(score: Score, time: Array) -> Array:
    """How the stamps shake the body (n,), 0 to 1 and back at each."""
    shock = np.zeros_like(time)
    for step in score.steps:
        if step.stamp:
            landing = step.beat * score.seconds_per_beat
            shock += easing.bump(time, landing - 0.03, landing + 0.06, landing + 0.4)
    return shock


def _depth(score: Score, time: Array) -> Array:
    """By how much the hips sink below standing (n,), metres."""
    depth: Array = _track(score, time + SHOULDER_LEAD, lambda pose: np.array([pose.depth]))[:, 0]
    return depth + 0.012 * _shock(score, time)


def _trunk(score: Score, time: Array, rotations: Array) -> None:
    """Sets root, sacroiliac, vl5 and skullbase in `rotations`."""
    facing = balance.facing(score, time)
    trunk = _track(score, time + SHOULDER_LEAD, lambda pose: np.radians([pose.bow, pose.lean, pose.twist]))
    head = _track(score, time + HEAD_LEAD, lambda pose: np.radians([pose.look, pose.nod, pose.tilt]))
    bow, lean, twist = trunk.T
    look, nod, tilt = head.T
    breath = np.sin(2.0 * np.pi * BREATHS * time / score.duration)
    bow = bow + np.radians(0.8) * breath
    nod = nod + np.radians(3.0) * _shock(score, time)
    look = look + NECK * np.tanh((balance.facing(score, time + TURN_LEAD) - facing) / NECK)
    rotations[:, 0] = _turned(facing, 0.4 * bow, -0.3 * lean)
    rotations[:, INDEX["sacroiliac"]] = _turned(0.2 * twist, -0.15 * bow, 0.0 * lean)
    rotations[:, INDEX["vl5"]] = _turned(twist, 0.6 * bow, -0.7 * lean)
    rotations[:, INDEX["skullbase"]] = _turned(look - twist, nod, -tilt)


def _turned(y: Array, x: Array, z: Array) -> Array:
    """Turns (n, 4) about z, then x, then y, by angles (n,) in radians."""
    about = rotation.about_axis
    return rotation.multiply(rotation.multiply(about(1, y), about(0, x)), about(2, z))


def _arm(score: Score, figure: Figure, time: Array, side: Side, rotations: Array) -> None:
    """Sets shoulder, elbow and wrist of one side in `rotations`; each arm of a pose is solved once."""
    arms = {pose: getattr(pose, side) for pose in (score.rest, *(key.pose for key in score.keys))}
    solved = {pose: solve_arm(figure, arm) for pose, arm in arms.items()}
    shoulder = _track(score, time + SHOULDER_LEAD, lambda pose: solved[pose][:3])
    elbow = _track(score, time - ELBOW_LAG, lambda pose: solved[pose][3:4])[:, 0]
    wrist = _track(score, time - WRIST_LAG, lambda pose: solved[pose][4:])
    from_vector, mirror = rotation.from_rotation_vector, _MIRROR[side]
    rotations[:, INDEX[f"{side[0]}_shoulder"]] = rotation.multiply(
        from_vector(_SHOULDER_MIDDLE * mirror), from_vector(shoulder * mirror)
    )
    rotations[:, INDEX[f"{side[0]}_elbow"]] = rotation.about_axis(0, -np.clip(elbow, 0.0, None))
    rotations[:, INDEX[f"{side[0]}_wrist"]] = from_vector(wrist * mirror)


def solve_arm(figure: Figure, arm: Arm) -> Array:
    """A left arm (7,), radians: shoulder, a rotation vector from the middle of its range, bend of the elbow, wrist."""
    upper, lower = figure.offsets[INDEX["l_elbow"]], figure.offsets[INDEX["l_wrist"]]
    target = np.array([arm.wrist]) * two_bone.reach(upper, lower)
    turned, bend = two_bone.solve(upper, lower, target, np.array([arm.elbow]), two_bone.ELBOW)
    middle = rotation.from_rotation_vector(_SHOULDER_MIDDLE)
    shoulder = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(middle), turned[0]))
    about = rotation.about_axis
    hand = rotation.multiply(about(1, np.radians(arm.turn)), about(2, np.radians(-arm.bend)))
    return np.concatenate([shoulder, bend, rotation.to_rotation_vector(hand)])
