from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import constants
from bunraku.marionette.limb_rig import ArmRig, LegRig, Limb
from bunraku.marionette.proportions import ProportionsError
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector
from bunraku.motion import rotation, skeleton
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS, Figure, standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
HANDS = {limb: ArmRig(FIGURE, limb) for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND)}
LEGS = {limb: LegRig(FIGURE, limb) for limb in (Limb.LEFT_LEG, Limb.RIGHT_LEG)}
POSES = random_motion(120, seed=5)

hands = st.sampled_from(sorted(HANDS))
legs = st.sampled_from(sorted(LEGS))
poses = st.integers(0, len(POSES) - 1).map(lambda i: POSES[i])
parts = st.floats(-1.0, 1.0)
directions = st.tuples(parts, parts, parts).filter(lambda v: vector.length(v) > 0.05)


def transforms_with_limb(pose: Array, limb: Limb, joints: tuple[tuple[float, ...], ...]) -> tuple[Array, Array]:
    """Return world positions and orientations of a pose with one limb's joints replaced, root at the origin."""
    merged = pose.copy()
    merged[list(limb.joint_indices)] = joints
    return skeleton.world_transforms(FIGURE, np.zeros(3), merged)


def test_limb_joints_equal_the_specification() -> None:
    assert [[JOINTS[k] for k in limb.joint_indices] for limb in Limb] == [
        ["l_shoulder", "l_elbow", "l_wrist"],
        ["r_shoulder", "r_elbow", "r_wrist"],
        ["l_hip", "l_knee", "l_ankle"],
        ["r_hip", "r_knee", "r_ankle"],
    ]


@given(hands, poses, directions, st.floats(0.12, 0.999))
def test_world_hand_tip_is_at_the_target_and_the_arm_hangs(
    limb: Limb, pose: Array, direction: Vector, reach: float
) -> None:
    rig = HANDS[limb]
    target = vector.scale(vector.unit(direction, (0.0, -1.0, 0.0)), reach)
    position, orientation = transforms_with_limb(pose, limb, rig.solve(target, rig.local_up(pose.tolist())))
    shoulder, elbow, wrist = limb.joint_indices
    tip = position[wrist] + rotation.rotate(orientation[wrist], FIGURE.tips[wrist])
    offset = rotation.rotate(orientation[JOINT_INDEX["vl5"]], np.array(target)) * rig.arm_length_m
    np.testing.assert_allclose(tip - position[shoulder], offset, atol=1e-9)
    # all joints are in one vertical plane
    level = np.stack([position[elbow], position[wrist], tip])[:, [0, 2]] - position[shoulder][[0, 2]]
    level_offset = offset[[0, 2]]
    if np.hypot(*level_offset) > 1e-3:
        distance = (level[:, 0] * level_offset[1] - level[:, 1] * level_offset[0]) / np.hypot(*level_offset)
        assert float(np.abs(distance).max()) < 1e-9
    # the elbow is below the chord
    chord = offset / np.linalg.norm(offset)
    sag = (position[elbow] - position[shoulder]) - chord * float(chord @ (position[elbow] - position[shoulder]))
    assert sag[1] < 1e-9


@given(hands, poses)
def test_tip_target_of_a_pose_equals_its_hand_tip(limb: Limb, pose: Array) -> None:
    rig = HANDS[limb]
    position, orientation = skeleton.world_transforms(FIGURE, np.zeros(3), pose)
    shoulder, _, wrist = limb.joint_indices
    tip = position[wrist] + rotation.rotate(orientation[wrist], FIGURE.tips[wrist]) - position[shoulder]
    chest = rotation.conjugate(orientation[JOINT_INDEX["vl5"]])
    target = rig.tip_target(rig.pose_joints(pose.tolist()))
    np.testing.assert_allclose(target, rotation.rotate(chest, tip) / rig.arm_length_m, atol=1e-12)


@given(directions, st.floats(0.12, 0.99))
def test_left_and_right_arm_mirror_each_other(direction: Vector, reach: float) -> None:
    x, y, z = vector.scale(vector.unit(direction, (0.0, -1.0, 0.0)), reach)
    left = HANDS[Limb.LEFT_HAND].solve((x, y, z), (0.0, 1.0, 0.0))
    right = HANDS[Limb.RIGHT_HAND].solve((-x, y, z), (0.0, 1.0, 0.0))
    if np.hypot(x, z) < 1e-6:
        return
    for a, b in zip(left, right, strict=True):
        mirrored = (b[0], b[1], -b[2], -b[3])
        assert abs(abs(sum(p * q for p, q in zip(a, mirrored, strict=True))) - 1.0) < 1e-9


def test_hand_in_front_has_palm_down_and_elbow_bent_forwards() -> None:
    joints = HANDS[Limb.LEFT_HAND].solve((0.0, -0.5, 0.5), (0.0, 1.0, 0.0))
    bend = vector.rotate(joints[1], (0.0, -1.0, 0.0))
    assert bend[2] > 0.2
    assert abs(bend[0]) < 0.1
    hand_rotation = vector.multiply(vector.multiply(joints[0], joints[1]), joints[2])
    palm = vector.rotate(hand_rotation, (-1.0, 0.0, 0.0))
    assert palm[1] < 0.0


@given(legs, poses, st.floats(constants.MIN_THIGH_ANGLE_RAD, constants.MAX_THIGH_ANGLE_RAD))
def test_thigh_lifts_in_the_facing_plane_of_the_hips(limb: Limb, pose: Array, theta: float) -> None:
    rig = LEGS[limb]
    position, orientation = transforms_with_limb(pose, limb, rig.solve(theta, pose.tolist()))
    hip, knee, ankle = limb.joint_indices
    thigh, shank = position[knee] - position[hip], position[ankle] - position[knee]
    _, level = rig.hip_facing(pose.tolist())
    thigh = thigh / np.linalg.norm(thigh)
    np.testing.assert_allclose(
        thigh, np.sin(theta) * np.array(level) - np.cos(theta) * np.array([0, 1.0, 0]), atol=1e-9
    )
    if theta >= 0.0:
        np.testing.assert_allclose(shank / np.linalg.norm(shank), [0.0, -1.0, 0.0], atol=1e-9)
        sole = rotation.rotate(orientation[ankle], np.array([0.0, 1.0, 0.0]))
        np.testing.assert_allclose(sole, [0.0, 1.0, 0.0], atol=1e-9)
    else:
        np.testing.assert_allclose(shank / np.linalg.norm(shank), thigh, atol=1e-9)
    merged = pose.copy()
    merged[list(limb.joint_indices)] = rig.solve(theta, pose.tolist())
    assert abs(rig.thigh_angle(merged.tolist()) - theta) < 1e-9


def test_sideways_hips_have_a_facing_direction() -> None:
    pose = np.tile(rotation.IDENTITY, (18, 1))
    pose[0] = rotation.from_coordinate_axis(2, np.array(np.pi / 2.0))
    _, level = LEGS[Limb.LEFT_LEG].hip_facing(pose.tolist())
    assert abs(vector.length(level) - 1.0) < 1e-12
    assert level[1] == 0.0
    assert level[2] > 0.9


def test_arm_without_a_hand_raises_proportions_error() -> None:
    tips = FIGURE.tips.copy()
    tips[JOINT_INDEX["l_wrist"]] = 0.0
    with pytest.raises(ProportionsError, match="L2"):
        ArmRig(Figure(FIGURE.offsets, tips), Limb.LEFT_HAND)


def test_thigh_lifted_over_the_top_stays_at_its_limit() -> None:
    rig = LegRig(FIGURE, Limb.LEFT_LEG)
    pose = np.tile(rotation.IDENTITY, (18, 1))
    angle, angles = 0.0, []
    for lifted in np.linspace(0.0, 4.0, 100):
        pose[rig.joint_indices[0]] = rotation.from_coordinate_axis(0, np.array(-lifted))
        angle = rig.thigh_angle(pose.tolist(), angle)
        angles.append(angle)
    assert max(angles) == constants.MAX_THIGH_ANGLE_RAD == angles[-1]
    assert np.abs(np.diff(angles)).max() < 0.05


def test_shoulder_frame_is_that_of_the_forward_kinematics() -> None:
    root, pose = np.array([[0.3, 0.9, -0.2]]), POSES[7]
    positions = skeleton.joint_and_tip_positions(FIGURE, root, pose[None])[0]
    for limb, rig in HANDS.items():
        position, turn = rig.shoulder_frame((0.3, 0.9, -0.2), pose.tolist())
        np.testing.assert_allclose(position, positions[limb.joint_indices[0]], atol=1e-12)
        chest = rotation.multiply(pose[0], pose[JOINT_INDEX["vl5"]])
        np.testing.assert_allclose(turn, chest, atol=1e-12)
