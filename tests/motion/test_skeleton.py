from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.skeleton import (
    CHANNEL_COUNT,
    JOINT_COUNT,
    JOINT_INDEX,
    PARENTS,
    Figure,
    Motion,
    joint_and_tip_positions,
    mean_facing,
    standard_figure,
    to_channels,
    world_transforms,
)


def rest_motion(frames: int = 1) -> Motion:
    return Motion(standard_figure(), 30.0, np.zeros((frames, 3)), np.tile(rotation.IDENTITY, (frames, JOINT_COUNT, 1)))


def test_parents_come_before_their_children() -> None:
    assert all(parent < joint for joint, parent in enumerate(PARENTS))


def test_standard_figure_matches_the_specification() -> None:
    motion = rest_motion()
    position, _ = world_transforms(motion.figure, motion.figure.offsets[0], motion.rotations[0])
    np.testing.assert_allclose(position[JOINT_INDEX["l_wrist"]], [0.1984, 0.8663, -0.0583], atol=1e-9)
    np.testing.assert_allclose(position[JOINT_INDEX["r_ankle"]], [-0.1101, 0.0656, -0.0736], atol=1e-9)
    crown = joint_and_tip_positions(motion.figure, motion.figure.offsets[0], motion.rotations[0])[18]
    np.testing.assert_allclose(crown, [0.0050, 1.7504, 0.0055], atol=1e-9)


def test_rotated_parent_moves_its_children() -> None:
    motion = rest_motion()
    motion.rotations[0, JOINT_INDEX["l_shoulder"]] = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    position, orientation = world_transforms(motion.figure, motion.root, motion.rotations)
    arm = position[0, JOINT_INDEX["l_elbow"]] - position[0, JOINT_INDEX["l_shoulder"]]
    assert arm[0] == pytest.approx(0.3019, abs=1e-3)  # from hanging down to pointing left
    np.testing.assert_allclose(orientation[0, JOINT_INDEX["l_wrist"]], orientation[0, JOINT_INDEX["l_shoulder"]])


def test_channels_are_the_nineteen_of_the_paper() -> None:
    made = to_channels(rest_motion(5))
    assert len(made) == CHANNEL_COUNT
    assert made[0].shape == (5, 3)
    assert all(channel.shape == (5, 4) for channel in made[1:])


def test_wrong_shapes_are_rejected() -> None:
    with pytest.raises(ValueError, match="offsets and tips"):
        Figure(np.zeros((17, 3)), np.zeros((18, 3)))
    with pytest.raises(ValueError, match="frame rate"):
        Motion(standard_figure(), 0.0, np.zeros((1, 3)), np.zeros((1, JOINT_COUNT, 4)))
    with pytest.raises(ValueError, match="rotations"):
        Motion(standard_figure(), 30.0, np.zeros((2, 3)), np.zeros((1, JOINT_COUNT, 4)))


def test_facing_is_the_mean_and_zero_for_a_turning_motion() -> None:
    motion = rest_motion(60)
    assert mean_facing(motion) == 0
    motion.rotations[:, 0] = rotation.from_coordinate_axis(1, np.linspace(2.0, 2.6, 60))
    assert mean_facing(motion) == pytest.approx(2.3, abs=0.01)
    motion.rotations[:, 0] = rotation.from_coordinate_axis(1, np.linspace(0, 2 * np.pi, 60))
    assert mean_facing(motion) == 0
