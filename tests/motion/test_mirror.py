from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.mirror import (
    OPPOSITE_JOINTS,
    mirror_body,
    mirror_figure,
    mirror_heading,
    mirror_motion,
    mirror_placement,
    mirror_vectors,
    opposite_joint,
)
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import (
    JOINT_COUNT,
    JOINTS,
    PARENTS,
    TIP_JOINTS,
    Figure,
    Motion,
    joint_and_tip_positions,
    mean_facing,
    standard_figure,
    world_transforms,
)
from tests.motion.extended_source import extended_source
from tests.vectors.blocks import random_motion

SEEDS = st.integers(0, 10_000)
COORDINATES = st.floats(-6.0, 6.0)


def lopsided_motion(seed: int) -> Motion:
    """Return a random motion of a figure whose sides differ."""
    motion, random = random_motion(0.4, 30.0, seed), np.random.default_rng(seed)
    figure = standard_figure()
    tips = figure.tips + random.normal(0, 0.05, (JOINT_COUNT, 3)) * (figure.tips.any(axis=1, keepdims=True))
    offsets = figure.offsets + random.normal(0, 0.05, (JOINT_COUNT, 3))
    return Motion(Figure(offsets, tips), motion.fps, motion.root, motion.rotations)


def reflect_points(points: np.ndarray) -> np.ndarray:
    """Return the mirror image of the positions (..., 23, 3) of joints and tips, each at the index of its joint."""
    tips = [JOINT_COUNT + TIP_JOINTS.index(OPPOSITE_JOINTS[joint]) for joint in TIP_JOINTS]
    reflected: np.ndarray = points[..., [*OPPOSITE_JOINTS, *tips], :] * [-1.0, 1.0, 1.0]
    return reflected


def test_joints_of_both_sides_are_exchanged() -> None:
    assert [opposite_joint(name) for name in ("l_hip", "r_wrist", "vl5", "skullbase")] == [
        "r_hip",
        "l_wrist",
        "vl5",
        "skullbase",
    ]
    for joint, opposite in enumerate(OPPOSITE_JOINTS):
        assert OPPOSITE_JOINTS[opposite] == joint
        if joint:
            assert PARENTS[opposite] == OPPOSITE_JOINTS[PARENTS[joint]], JOINTS[joint]


@given(SEEDS)
@settings(deadline=None, max_examples=40)
def test_mirrored_positions_are_the_reflection_of_the_others(seed: int) -> None:
    motion = lopsided_motion(seed)
    mirrored = mirror_motion(motion)
    before = joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    after = joint_and_tip_positions(mirrored.figure, mirrored.root, mirrored.rotations)
    np.testing.assert_allclose(after, reflect_points(before), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(mirrored.rotations, axis=-1), 1.0, atol=1e-12)


@given(SEEDS, COORDINATES, COORDINATES, COORDINATES)
@settings(deadline=None, max_examples=40)
def test_the_stage_with_placements_is_mirrored_as_a_whole(seed: int, x: float, z: float, turn: float) -> None:
    motion, placement = lopsided_motion(seed), Placement(x, z, turn)
    mirrored, mirrored_placement = mirror_motion(motion), mirror_placement(placement)
    before = joint_and_tip_positions(motion.figure, *placement.apply(motion.root, motion.rotations))
    after = joint_and_tip_positions(mirrored.figure, *mirrored_placement.apply(mirrored.root, mirrored.rotations))
    np.testing.assert_allclose(after, reflect_points(before), atol=1e-9)


@given(SEEDS, COORDINATES)
@settings(deadline=None, max_examples=40)
def test_mirroring_twice_is_the_identity(seed: int, value: float) -> None:
    motion = lopsided_motion(seed)
    again = mirror_motion(mirror_motion(motion))
    np.testing.assert_array_equal(again.root, motion.root)
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    np.testing.assert_array_equal(again.figure.offsets, motion.figure.offsets)
    np.testing.assert_array_equal(again.figure.tips, motion.figure.tips)
    placement = Placement(value, -value, value / 2)
    assert mirror_placement(mirror_placement(placement)) == placement
    assert mirror_heading(mirror_heading(value)) == value


def test_mirrored_motion_faces_the_mirrored_heading() -> None:
    motion = random_motion(0.1, 30.0, 4)
    assert mean_facing(mirror_motion(motion)) == np.float64(mirror_heading(mean_facing(motion)))


def test_symmetric_figure_stays_the_same() -> None:
    figure = standard_figure()
    sides = [joint for joint in range(JOINT_COUNT) if OPPOSITE_JOINTS[joint] != joint]
    np.testing.assert_allclose(
        mirror_figure(figure).offsets[[3, 4, 13, 14]], figure.offsets[[3, 4, 13, 14]], atol=1e-12
    )
    assert sides


def test_mirrored_extension_gives_the_mirror_image_of_the_pose() -> None:
    analysis = analyse(extended_source(40))
    assert analysis.extension is not None
    motion, extension, values = analysis.motion, analysis.extension.extension, analysis.extension.values
    placed = world_transforms(motion.figure, motion.root, motion.rotations)
    pose = extend_pose(motion.figure, extension, *placed, values)
    image = mirror_motion(motion)
    mirrored, mirrored_values = mirror_body(extension, values)
    image_placed = world_transforms(image.figure, image.root, image.rotations)
    image_pose = extend_pose(image.figure, mirrored, *image_placed, mirrored_values)
    order = [*range(len(extension.offsets) - 2), -1, -2]
    np.testing.assert_allclose(image_pose.extra_positions, mirror_vectors(pose.extra_positions[:, order]), atol=1e-9)
    np.testing.assert_allclose(
        image_pose.positions, mirror_vectors(pose.positions[:, list(OPPOSITE_JOINTS)]), atol=1e-9
    )
    again, again_values = mirror_body(mirrored, mirrored_values)
    np.testing.assert_array_equal(again_values, values)
    for name in ("offsets", "ends", "drive", "rest"):
        np.testing.assert_array_equal(getattr(again, name), getattr(extension, name))
