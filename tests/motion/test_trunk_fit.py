from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bunraku.motion.analysis import analyse
from bunraku.motion.fit import FigureFit
from bunraku.motion.readers import bvh
from bunraku.motion.rest_pose import find_rest_pose, sample_frames
from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from bunraku.motion.trunk_fit import CROWN_OFFSET_M, fit_trunk
from tests.motion.synthetic_motion import export_bvh, smooth_motion

MOTION = smooth_motion(frames=40)


@pytest.fixture
def fit() -> FigureFit:
    source = bvh.parse_bvh(export_bvh(MOTION))
    position, orientation = source.world_transforms(list(range(18)), sample_frames(source))
    joints = {name: joint for name, joint in JOINT_INDEX.items() if name != "vl5"}
    return FigureFit.from_source(
        source, joints, find_rest_pose(source, joints, sample_frames(source), position, orientation)
    )


def test_trunk_coincides_with_the_source(fit: FigureFit) -> None:
    fit_trunk(fit)
    placed, _ = world_transforms(MOTION.figure, MOTION.root, MOTION.rotations)
    trunk = [JOINT_INDEX[name] for name in ("humanoid_root", "sacroiliac", "vl5", "skullbase")]
    np.testing.assert_allclose(fit.joint_positions[:, trunk], placed[:, trunk], atol=1e-5)
    carried = [JOINT_INDEX[name] for name in ("l_hip", "r_hip", "l_shoulder", "r_shoulder")]
    np.testing.assert_allclose(fit.offsets[carried], MOTION.figure.offsets[carried], atol=1e-5)


def test_headless_source_gets_a_head_above_the_shoulders(fit: FigureFit) -> None:
    headless = replace(fit, joints={joint: of for joint, of in fit.joints.items() if joint != JOINT_INDEX["skullbase"]})
    fit_trunk(headless)
    head = headless.offsets[JOINT_INDEX["skullbase"]]
    shoulders = headless.offsets[[JOINT_INDEX["l_shoulder"], JOINT_INDEX["r_shoulder"]]]
    assert head[1] > shoulders[:, 1].max()
    assert headless.tips[JOINT_INDEX["skullbase"]].tolist() == [0.0, CROWN_OFFSET_M, 0.0]


def test_moving_hips_rotate_the_pelvis(fit: FigureFit) -> None:
    swung = replace(fit, position=fit.position.copy())
    hips = [JOINT_INDEX["l_hip"], JOINT_INDEX["r_hip"]]
    sway = 0.03 * np.sin(np.arange(40) / 5.0)
    swung.position[:, hips[0], 1] += sway
    swung.position[:, hips[1], 1] -= sway
    fit_trunk(swung)
    pelvis = JOINT_INDEX["sacroiliac"]
    kept = swung.relative_positions(pelvis, hips)
    line = kept[:, 0] - kept[:, 1]
    assert np.ptp(np.linalg.norm(line, axis=-1)) < 0.02
    assert np.abs(np.sum(swung.joint_orientations[:, pelvis] * fit.turn[:, pelvis], axis=-1)).min() < 1.0 - 1e-3


def test_analysis_finds_the_same_trunk() -> None:
    made = analyse(bvh.parse_bvh(export_bvh(MOTION))).motion
    np.testing.assert_allclose(
        made.figure.offsets[JOINT_INDEX["vl5"]], MOTION.figure.offsets[JOINT_INDEX["vl5"]], atol=1e-5
    )
