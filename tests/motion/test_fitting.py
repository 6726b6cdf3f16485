from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion import bvh, rotation
from bunraku.motion.fitting import Fit
from bunraku.motion.kinematics import pose
from bunraku.motion.rest import find_rest, sample
from bunraku.motion.skeleton import INDEX, world
from tests.motion.sources import dance, pose_with_arms, told

MOTION = dance(frames=40)


@pytest.fixture
def fit() -> Fit:
    source = bvh.read(told(MOTION, pose_with_arms(90.0), rotation.about_axis(0, np.array(np.pi / 2))))
    position, orientation = pose(source, list(range(18)), sample(source))
    joints = {name: joint for name, joint in INDEX.items() if name != "vl5"}
    return Fit.begin(source, joints, find_rest(source, joints, sample(source), position, orientation))


def test_the_source_is_in_the_figures_axes_and_metres(fit: Fit) -> None:
    placed, oriented = world(MOTION.figure, MOTION.root, MOTION.rotations)
    np.testing.assert_allclose(fit.position, placed, atol=1e-6)
    np.testing.assert_allclose(np.abs(np.sum(fit.turn[:, :12] * oriented[:, :12], axis=-1)), 1.0, atol=1e-9)


def test_without_first_keeps_the_rest(fit: Fit) -> None:
    shorter = fit.without_first()
    np.testing.assert_array_equal(shorter.position, fit.position[1:])
    assert shorter.placed.shape == (39, 18, 3)


def test_bones_and_what_lies_beyond(fit: Fit) -> None:
    bone, length = fit.bone(INDEX["l_knee"])
    np.testing.assert_allclose(bone, MOTION.figure.offsets[INDEX["l_ankle"]], atol=1e-6)
    assert length == pytest.approx(np.linalg.norm(bone), abs=1e-6)
    hand = fit.beyond(INDEX["l_wrist"])
    assert hand is not None
    np.testing.assert_allclose(hand, [0.18, 0.0, 0.0], atol=1e-6)
