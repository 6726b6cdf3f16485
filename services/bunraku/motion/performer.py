"""The body that performs a score: arms and trunk from pose to pose, weight over the feet, legs that reach the floor."""

from __future__ import annotations

import numpy as np

from bunraku.motion import easing, footwork, mass, rotation, skeleton, two_bone
from bunraku.motion.easing import Move
from bunraku.motion.footwork import Foot
from bunraku.motion.rotation import Array
from bunraku.motion.score import Arm, Pose, Score, Side
from bunraku.motion.skeleton import INDEX, JOINT_COUNT, Figure, Motion

SHOULDER_LEAD, ELBOW_LAG, WRIST_LAG, HEAD_LEAD = 0.03, 0.03, 0.09, 0.06
"""Seconds by which parts of the body set out before and after the beat they are written for: the trunk carries the arms."""
BREATH = 5.0
"""Seconds of one breath."""


def perform(score: Score, figure: Figure, fps: float) -> Motion:
    """The motion of `score` danced by `figure` at `fps` frames a second; its last frame leads on to its first."""
    time = np.arange(round(score.duration * fps)) / fps
    rotations = np.tile(rotation.IDENTITY, (len(time), JOINT_COUNT, 1))
    facing = footwork.facing(score, time)
    depth = _trunk(score, time, facing, rotations)
    for side in ("left", "right"):
        _arm(score, figure, time, side, rotations)
    feet = {side: footwork.foot(score, figure, side, time) for side in ("left", "right")}
    height = figure.offsets[0][1] - depth + footwork.leap(score, time)
    root = _stand(figure, rotations, feet, facing, height, footwork.weight(score, time))
    return Motion(figure, fps, root, rotations)


def _track(score: Score, time: Array, values: dict[Pose, Array], lag: float = 0.0) -> Array:
    """What `values` says of each pose (k,), from key to key, over `time` (n,): (n, k)."""
    beat = score.seconds_per_beat
    moves = []
    before = score.rest
    for key in score.keys:
        ease = easing.minimum_jerk if key.even else easing.crisp
        moves.append(Move((key.beat - key.over) * beat, key.over * beat, values[key.pose] - values[before], ease))
        before = key.pose
    return easing.superpose(time - lag, values[score.rest], moves)


def _poses(score: Score) -> set[Pose]:
    return {score.rest, *(key.pose for key in score.keys)}


def _trunk(score: Score, time: Array, facing: Array, rotations: Array) -> Array:
    """Sets root, sacroiliac, vl5 and skullbase in `rotations`; returns by how much the hips sink (n,), metres."""

    def track(names: tuple[str, ...], lag: float) -> Array:
        return _track(score, time, {p: np.array([getattr(p, name) for name in names]) for p in _poses(score)}, lag)

    depth = track(("depth",), -SHOULDER_LEAD)[:, 0]
    bow, lean, twist = np.radians(track(("bow", "lean", "twist"), -SHOULDER_LEAD)).T
    look, nod, tilt = np.radians(track(("look", "nod", "tilt"), -HEAD_LEAD)).T
    bow = bow + np.radians(0.8) * np.sin(2.0 * np.pi * time / BREATH)
    for step in score.steps:
        if step.stamp:
            landing = step.beat * score.seconds_per_beat
            shock = easing.bump(time, landing - 0.03, landing + 0.06, landing + 0.4)
            depth = depth + 0.012 * shock
            nod = nod + np.radians(3.0) * shock
    # the head turns before the body does, never further than the neck can
    ahead = np.interp(time + 0.3, time, facing) - facing
    look = look + np.radians(40.0) * np.tanh(ahead / np.radians(40.0))

    def turn(y: Array, x: Array, z: Array) -> Array:
        about = rotation.about_axis
        return rotation.multiply(rotation.multiply(about(1, y), about(0, x)), about(2, z))

    still = np.zeros_like(time)
    rotations[:, 0] = turn(facing, 0.4 * bow, -0.3 * lean)
    rotations[:, INDEX["sacroiliac"]] = turn(0.2 * twist, -0.15 * bow, still)
    rotations[:, INDEX["vl5"]] = turn(twist, 0.6 * bow, -0.7 * lean)
    rotations[:, INDEX["skullbase"]] = turn(look - twist, nod, -tilt)
    return depth


def _arm(score: Score, figure: Figure, time: Array, side: Side, rotations: Array) -> None:
    """Sets shoulder, elbow and wrist of one side in `rotations`, from arms solved at the keys only."""
    solved = {pose: _solve_arm(figure, getattr(pose, side)) for pose in _poses(score)}
    mirror = np.array([1.0, 1.0, 1.0]) if side == "left" else np.array([1.0, -1.0, -1.0])
    shoulder = _track(score, time, {pose: s[:3] for pose, s in solved.items()}, -SHOULDER_LEAD)
    elbow = _track(score, time, {pose: s[3:4] for pose, s in solved.items()}, ELBOW_LAG)[:, 0]
    wrist = _track(score, time, {pose: s[4:] for pose, s in solved.items()}, WRIST_LAG)
    middle = _MIDDLE_OF_SHOULDER * mirror
    letter = side[0]
    rotations[:, INDEX[f"{letter}_shoulder"]] = rotation.multiply(
        rotation.from_rotation_vector(middle), rotation.from_rotation_vector(shoulder * mirror)
    )
    rotations[:, INDEX[f"{letter}_elbow"]] = rotation.about_axis(0, -np.clip(elbow, 0.0, None))
    rotations[:, INDEX[f"{letter}_wrist"]] = rotation.from_rotation_vector(wrist * mirror)


_MIDDLE_OF_SHOULDER: Array = np.array([-0.8, 0.0, 0.8])
"""The rotation vector of a left shoulder in the middle of its range; shoulders are written as turns from here, so that none
comes near the half turn where a rotation vector jumps."""


def _solve_arm(figure: Figure, arm: Arm) -> Array:
    """Shoulder (3, a rotation vector from the middle of its range), elbow flexion and wrist (3) of a left arm, radians."""
    upper, lower = figure.offsets[INDEX["l_elbow"]], figure.offsets[INDEX["l_wrist"]]
    target = np.array([arm.wrist]) * two_bone.reach(upper, lower)
    turned, flexion = two_bone.solve(upper, lower, target, np.array([arm.elbow]), two_bone.ELBOW)
    middle = rotation.from_rotation_vector(_MIDDLE_OF_SHOULDER)
    shoulder = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(middle), turned))[0]
    hand = rotation.multiply(
        rotation.about_axis(1, np.radians(arm.turn)),
        rotation.about_axis(2, np.radians(-arm.bend)),
    )
    return np.concatenate([shoulder, flexion, rotation.to_rotation_vector(hand)])


def _stand(figure: Figure, rotations: Array, feet: dict[Side, Foot], facing: Array, height: Array, weight: Array) -> Array:
    """Places the root (n, 3) so that the weight is where it must be and both feet are reached; sets the legs."""
    n = len(rotations)
    upright = skeleton.points(figure, np.zeros((n, 3)), rotations)
    position, orientation = skeleton.world(figure, np.zeros((n, 3)), rotations)
    pelvis = orientation[:, INDEX["sacroiliac"]]
    root = np.stack([weight[:, 0], height, weight[:, 1]], axis=-1)
    body = upright
    for _ in range(5):
        root[:, 1] = height
        body = upright + root[:, None]
        limits = [height]
        for side, foot in feet.items():
            letter = side[0]
            furthest = two_bone.reach(figure.offsets[INDEX[f"{letter}_knee"]], figure.offsets[INDEX[f"{letter}_ankle"]]) - 0.002
            hip = position[:, INDEX[f"{letter}_hip"]]
            beside = np.sum((root + hip - foot.ankle)[:, [0, 2]] ** 2, axis=-1)
            limits.append(foot.ankle[:, 1] - hip[:, 1] + np.sqrt(np.clip(furthest**2 - beside, 0.0, None)))
        root[:, 1] = _softest(np.stack(limits))
        body = upright + root[:, None]
        for side, foot in feet.items():
            letter = side[0]
            knee, ankle, toes = (INDEX[f"{letter}_{joint}"] for joint in ("knee", "ankle", "midtarsal"))
            thigh, flexion = _leg(figure, side, foot, body[:, INDEX[f"{letter}_hip"]], facing)
            body[:, knee] = body[:, INDEX[f"{letter}_hip"]] + rotation.rotate(thigh, figure.offsets[knee])
            body[:, ankle] = foot.ankle
            body[:, toes] = foot.ankle + rotation.rotate(foot.orientation, figure.offsets[toes])
            tip = mass.LEFT_TOES if side == "left" else mass.RIGHT_TOES
            body[:, tip] = body[:, toes] + rotation.rotate(foot.orientation, figure.tips[toes])
        root[:, [0, 2]] += weight - mass.centre_of_mass(body)[:, [0, 2]]
    for side, foot in feet.items():
        letter = side[0]
        thigh, flexion = _leg(figure, side, foot, root + position[:, INDEX[f"{letter}_hip"]], facing)
        shin = rotation.multiply(thigh, rotation.about_axis(0, flexion))
        rotations[:, INDEX[f"{letter}_hip"]] = rotation.multiply(rotation.conjugate(pelvis), thigh)
        rotations[:, INDEX[f"{letter}_knee"]] = rotation.about_axis(0, flexion)
        rotations[:, INDEX[f"{letter}_ankle"]] = rotation.multiply(rotation.conjugate(shin), foot.orientation)
        rotations[:, INDEX[f"{letter}_midtarsal"]] = rotation.about_axis(0, -foot.toes)
    return root


def _leg(figure: Figure, side: Side, foot: Foot, hip: Array, facing: Array) -> tuple[Array, Array]:
    """World orientation of the thigh (n, 4) and flexion of the knee (n,) that bring the ankle from `hip` (n, 3) to the foot."""
    outwards = np.radians(8.0 if side == "left" else -8.0)
    forward = 0.5 * (facing + foot.facing) + outwards
    pole = np.stack([np.sin(forward), np.zeros_like(forward), np.cos(forward)], axis=-1)
    letter = side[0]
    upper, lower = figure.offsets[INDEX[f"{letter}_knee"]], figure.offsets[INDEX[f"{letter}_ankle"]]
    return two_bone.solve(upper, lower, foot.ankle - hip, pole, two_bone.KNEE)


def _softest(limits: Array) -> Array:
    """A smooth minimum (n,) of `limits` (m, n) metres, below all of them, by at most 8 mm * ln m."""
    lowest = np.min(limits, axis=0)
    soft: Array = lowest - 0.008 * np.log(np.sum(np.exp(-(limits - lowest) / 0.008), axis=0))
    return soft
