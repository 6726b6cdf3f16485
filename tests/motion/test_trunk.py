from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bunraku.motion import bvh
from bunraku.motion.analysis import analyse
from bunraku.motion.fitting import Fit
from bunraku.motion.kinematics import pose
from bunraku.motion.rest import find_rest, sample
from bunraku.motion.skeleton import INDEX, world
from bunraku.motion.trunk import CROWN, place_trunk
from tests.motion.sources import dance, told

MOTION = dance(frames=40)


@pytest.fixture
def fit() -> Fit:
    source = bvh.read(told(MOTION))
    position, orientation = pose(source, list(range(18)), sample(source))
    joints = {name: joint for name, joint in INDEX.items() if name != "vl5"}
    return Fit.begin(source, joints, find_rest(source, joints, sample(source), position, orientation))


def test_the_trunk_lies_on_a_source_that_has_it(fit: Fit) -> None:
    place_trunk(fit)
    placed, _ = world(MOTION.figure, MOTION.root, MOTION.rotations)
    trunk = [INDEX[name] for name in ("humanoid_root", "sacroiliac", "vl5", "skullbase")]
    np.testing.assert_allclose(fit.placed[:, trunk], placed[:, trunk], atol=1e-5)
    carried = [INDEX[name] for name in ("l_hip", "r_hip", "l_shoulder", "r_shoulder")]
    np.testing.assert_allclose(fit.offsets[carried], MOTION.figure.offsets[carried], atol=1e-5)


def test_a_source_without_a_head_gets_one_over_the_shoulders(fit: Fit) -> None:
    headless = replace(fit, joints={joint: of for joint, of in fit.joints.items() if joint != INDEX["skullbase"]})
    place_trunk(headless)
    head = headless.offsets[INDEX["skullbase"]]
    shoulders = headless.offsets[[INDEX["l_shoulder"], INDEX["r_shoulder"]]]
    assert head[1] > shoulders[:, 1].max()
    assert headless.tips[INDEX["skullbase"]].tolist() == [0.0, CROWN, 0.0]


def test_hips_that_move_in_the_pelvis_turn_it(fit: Fit) -> None:
    swung = replace(fit, position=fit.position.copy())
    hips = [INDEX["l_hip"], INDEX["r_hip"]]
    sway = 0.03 * np.sin(np.arange(40) / 5.0)
    swung.position[:, hips[0], 1] += sway
    swung.position[:, hips[1], 1] -= sway
    place_trunk(swung)
    pelvis = INDEX["sacroiliac"]
    kept = swung.relative(pelvis, hips)
    line = kept[:, 0] - kept[:, 1]
    assert np.ptp(np.linalg.norm(line, axis=-1)) < 0.02
    assert np.abs(np.sum(swung.oriented[:, pelvis] * fit.turn[:, pelvis], axis=-1)).min() < 1.0 - 1e-3


def test_the_whole_analysis_finds_the_same_trunk() -> None:
    made = analyse(bvh.read(told(MOTION))).motion
    np.testing.assert_allclose(made.figure.offsets[INDEX["vl5"]], MOTION.figure.offsets[INDEX["vl5"]], atol=1e-5)
