from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.fit import FigureFit
from bunraku.motion.readers import bvh
from bunraku.motion.rest_pose import find_rest_pose, sample_frames
from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from tests.motion.synthetic_motion import export_bvh, pose_with_arms, smooth_motion

MOTION = smooth_motion(frames=40)


@pytest.fixture
def fit() -> FigureFit:
    source = bvh.parse_bvh(
        export_bvh(MOTION, pose_with_arms(90.0), rotation.from_coordinate_axis(0, np.array(np.pi / 2)))
    )
    position, orientation = source.world_transforms(list(range(18)), sample_frames(source))
    joints = {name: joint for name, joint in JOINT_INDEX.items() if name != "vl5"}
    return FigureFit.from_source(
        source, joints, find_rest_pose(source, joints, sample_frames(source), position, orientation)
    )


def test_source_is_in_the_figures_axes_and_metres(fit: FigureFit) -> None:
    placed, oriented = world_transforms(MOTION.figure, MOTION.root, MOTION.rotations)
    np.testing.assert_allclose(fit.position, placed, atol=1e-6)
    np.testing.assert_allclose(np.abs(np.sum(fit.turn[:, :12] * oriented[:, :12], axis=-1)), 1.0, atol=1e-9)


def test_without_first_frame_keeps_the_others(fit: FigureFit) -> None:
    shorter = fit.without_first_frame()
    np.testing.assert_array_equal(shorter.position, fit.position[1:])
    assert shorter.joint_positions.shape == (39, 18, 3)


def test_bones_and_farthest_descendants_are_measured(fit: FigureFit) -> None:
    bone, length = fit.measure_bone(JOINT_INDEX["l_knee"])
    np.testing.assert_allclose(bone, MOTION.figure.offsets[JOINT_INDEX["l_ankle"]], atol=1e-6)
    assert length == pytest.approx(np.linalg.norm(bone), abs=1e-6)
    hand = fit.farthest_descendant(JOINT_INDEX["l_wrist"])
    assert hand is not None
    np.testing.assert_allclose(hand, [0.18, 0.0, 0.0], atol=1e-6)
