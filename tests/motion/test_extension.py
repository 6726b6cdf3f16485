from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.extension import BodyExtension, JointKind, extend_pose, find_driver, meet_bone
from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from tests.motion.synthetic_motion import smooth_motion

HEAD, VL5, WRIST = JOINT_INDEX["skullbase"], JOINT_INDEX["vl5"], JOINT_INDEX["l_wrist"]
SHOULDER = JOINT_INDEX["l_shoulder"]


def still_extension(spine_count: int = 2, has_neck: bool = True, has_clavicles: bool = True) -> BodyExtension:
    """Return an extension without drive, whose joints lie above one another."""
    count = spine_count + has_neck + 2 * has_clavicles
    ends = np.array([[0.0, 0.1, 0.0], [0.18, 0.0, 0.0], [-0.18, 0.0, 0.0]])
    offsets = np.tile([0.0, 0.12, 0.0], (count, 1))
    return BodyExtension(
        spine_count, has_neck, has_clavicles, offsets, ends, np.zeros((count, 3, 3)), np.zeros((count, 3))
    )


def test_names_and_kinds_follow_the_parts() -> None:
    extension = still_extension(3)
    assert extension.names == ("vl5", "vl1", "vt10", "vc4", "l_sternoclavicular", "r_sternoclavicular")
    assert extension.kinds[-3:] == [JointKind.NECK, JointKind.LEFT_CLAVICLE, JointKind.RIGHT_CLAVICLE]
    assert still_extension(1, has_neck=False, has_clavicles=False).names == ("vl5",)


@pytest.mark.parametrize("spine_count", [0, 1, 4])
@pytest.mark.parametrize(("has_neck", "has_clavicles"), [(True, True), (False, True), (True, False)])
def test_extended_pose_keeps_bones_hands_and_legs(spine_count: int, has_neck: bool, has_clavicles: bool) -> None:
    motion = smooth_motion(20)
    extension = still_extension(spine_count, has_neck, has_clavicles)
    positions, orientations = world_transforms(motion.figure, motion.root, motion.rotations)
    values = np.random.default_rng(1).normal(0, 0.2, (20, len(extension.offsets), 3))
    pose = extend_pose(motion.figure, extension, positions, orientations, values)
    np.testing.assert_array_equal(pose.positions[:, :10], positions[:, :10])
    np.testing.assert_array_equal(pose.orientations[:, [HEAD, WRIST]], orientations[:, [HEAD, WRIST]])
    for joint in (SHOULDER + 1, WRIST):
        length = np.linalg.norm(pose.positions[:, joint] - pose.positions[:, joint - 1], axis=-1)
        np.testing.assert_allclose(length, np.linalg.norm(motion.figure.offsets[joint]), atol=1e-12)
        turned = pose.positions[:, joint - 1] + rotation.rotate(
            pose.orientations[:, joint - 1], motion.figure.offsets[joint]
        )
        np.testing.assert_allclose(turned, pose.positions[:, joint], atol=1e-9)


def test_extension_without_values_stands_above_the_root() -> None:
    motion, extension = smooth_motion(1), still_extension(2)
    positions, orientations = world_transforms(motion.figure, motion.root, motion.rotations)
    pose = extend_pose(motion.figure, extension, positions, orientations, np.zeros((1, 5, 3)))
    heights = pose.extra_positions[0, :3, 1] - positions[0, 0, 1]
    np.testing.assert_allclose(heights, [0.12, 0.24, 0.36], atol=1e-12)
    np.testing.assert_allclose(pose.positions[0, HEAD] - pose.extra_positions[0, 2], [0, 0.1, 0], atol=1e-12)


def test_clavicle_follows_the_direction_of_its_arm() -> None:
    motion = smooth_motion(30)
    positions, orientations = world_transforms(motion.figure, motion.root, motion.rotations)
    driver = find_driver(JointKind.LEFT_CLAVICLE, positions, orientations, orientations[:, VL5])
    arm = positions[:, SHOULDER + 1] - positions[:, SHOULDER]
    np.testing.assert_allclose(
        rotation.rotate(orientations[:, VL5], driver), arm / np.linalg.norm(arm, axis=-1, keepdims=True), atol=1e-12
    )
    np.testing.assert_allclose(
        find_driver(JointKind.SPINE, positions, orientations, orientations[:, VL5]),
        rotation.to_rotation_vector(motion.rotations[:, VL5]),
        atol=1e-12,
    )


points = st.lists(st.floats(-1, 1), min_size=3, max_size=3)


@given(points, points, points, st.floats(0.05, 1))
def test_bone_has_its_length_and_lies_on_the_line_within_reach(
    a: list[float], b: list[float], c: list[float], length: float
) -> None:
    start, end, own = (np.array([each]) for each in (a, b, c))
    met = meet_bone(start, end, own, length)
    assert np.linalg.norm(met - own) <= length + 1e-9
    line = end - start
    # a bone without length has no line
    if np.linalg.norm(line) > 1e-3:
        assert np.linalg.norm(met - own) == pytest.approx(length, abs=1e-9)
        along = line / np.linalg.norm(line)
        distance = np.linalg.norm(np.cross(own - start, along))
        if distance < length - 1e-3:
            assert np.linalg.norm(np.cross(met - start, along)) < 1e-6
