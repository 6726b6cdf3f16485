from __future__ import annotations

from math import atan2, cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import constants, leg
from bunraku.marionette.limb_rig import LegRig, Limb
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import JointRotations, Vector
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
POSES = [rotations.tolist() for rotations in random_motion(12, seed=3)]
LEGS = {limb: LegRig(FIGURE, limb) for limb in (Limb.LEFT_LEG, Limb.RIGHT_LEG)}
legs = st.sampled_from(sorted(LEGS))
poses = st.integers(0, len(POSES) - 1)
angles = st.floats(-10.0, 10.0)


@given(angles)
def test_knee_bends_one_way_and_the_shank_hangs(theta: float) -> None:
    hip, knee = leg.solve_legs(np.array([theta]))
    assert constants.MIN_THIGH_ANGLE_RAD <= hip[0] <= constants.MAX_THIGH_ANGLE_RAD
    assert hip[0] == leg.clamp_thigh(theta)
    assert knee[0] == leg.knee_bend(leg.clamp_thigh(theta)) >= 0.0
    # angle of the shank from straight down
    assert hip[0] - knee[0] == min(hip[0], 0.0)


@given(angles, st.floats(0.0, 1.0))
def test_leg_angles_are_continuous_in_the_input(theta: float, step: float) -> None:
    hip, knee = leg.solve_legs(np.array([theta, theta + step]))
    for angle in (hip, knee):
        assert 0.0 <= angle[1] - angle[0] <= step + 1e-12


def plane_angles(rig: LegRig, index: int, joints: JointRotations) -> tuple[float, float, Vector, Vector]:
    """Return the forward angles of thigh and shank from straight down, and both as world unit vectors."""
    hips, level = rig.hip_facing(POSES[index])
    hip, knee, _ = joints
    thigh = vector.unit(vector.rotate(vector.multiply(hips, hip), rig.thigh), (0.0, 0.0, 0.0))
    x, y, z = FIGURE.offsets[rig.joint_indices[2]].tolist()
    shank = vector.unit(vector.rotate(vector.multiply(vector.multiply(hips, hip), knee), (x, y, z)), (0.0, 0.0, 0.0))
    return (
        atan2(vector.dot(thigh, level), -thigh[1]),
        atan2(vector.dot(shank, level), -shank[1]),
        thigh,
        shank,
    )


@given(legs, poses, angles)
def test_shank_hangs_vertically_and_knee_never_bends_backwards(limb: Limb, index: int, theta: float) -> None:
    rig = LEGS[limb]
    thigh_angle, shank_angle, thigh, shank = plane_angles(rig, index, rig.solve(theta, POSES[index]))
    lifted = leg.clamp_thigh(theta)
    assert thigh_angle == pytest.approx(lifted, abs=1e-9)
    if lifted >= 0.0:
        assert shank == pytest.approx((0.0, -1.0, 0.0), abs=1e-9)
    else:
        assert shank == pytest.approx(thigh, abs=1e-9)
    assert shank_angle <= thigh_angle + 1e-9
    _, level = rig.hip_facing(POSES[index])
    assert thigh == pytest.approx((level[0] * sin(lifted), -cos(lifted), level[2] * sin(lifted)), abs=1e-9)


@given(legs, poses, poses, angles, angles)
def test_ankle_rotation_is_constant(limb: Limb, index: int, other: int, theta: float, other_theta: float) -> None:
    rig = LEGS[limb]
    assert rig.solve(theta, POSES[index])[2] == rig.solve(other_theta, POSES[other])[2]


@given(legs, poses, angles, st.floats(0.0, 0.1))
def test_joints_rotate_at_most_as_far_as_the_input(limb: Limb, index: int, theta: float, step: float) -> None:
    rig = LEGS[limb]
    before, after = rig.solve(theta, POSES[index]), rig.solve(theta + step, POSES[index])
    for joint_before, joint_after in zip(before, after, strict=True):
        turn = vector.multiply(vector.conjugate(joint_before), joint_after)
        angle = 2.0 * atan2(vector.length((turn[1], turn[2], turn[3])), abs(turn[0]))
        assert angle <= step + 1e-7
