from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import elevation, vertical_normal
from bunraku.marionette.solver.vector import IDENTITY, JointRotations
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion

RIG = ArmRig(standard_figure(), Limb.LEFT_HAND)
POSES = random_motion(200, seed=8)
UP = (0.0, 1.0, 0.0)


def solved_joints(target: vector.Vector) -> JointRotations:
    reach = RIG.arm.clamp_distance(vector.length(target))
    return RIG.bend_joints(reach, RIG.arm.gravity_bend(reach, elevation(RIG.target_direction(target), UP)))


@given(st.integers(0, len(POSES) - 1), st.floats(0.0, 1.0))
def test_tip_stays_in_place_at_every_weight(index: int, weight: float) -> None:
    """The target is the hand tip of the motion itself."""
    joints = RIG.pose_joints(POSES[index].tolist())
    target = RIG.tip_target(joints)
    if vector.length(target) > 0.97 or vector.length(target) < 0.3:
        return  # a straight arm reaches less when its wrist bends
    normal = vertical_normal(RIG.target_direction(target), UP)
    assert normal is not None
    blended = ArmBlend(RIG).blend(joints, solved_joints(target), target, IDENTITY, normal, weight, 0.0)
    np.testing.assert_allclose(RIG.tip_target(blended), target, atol=1e-9)


@given(st.integers(0, len(POSES) - 1))
def test_weights_zero_and_one_are_exact(index: int) -> None:
    joints = RIG.pose_joints(POSES[index].tolist())
    target = vector.scale(vector.unit(RIG.tip_target(joints), UP), 0.6)
    normal = vertical_normal(RIG.target_direction(target), UP)
    assert normal is not None
    solved = solved_joints(target)
    assert ArmBlend(RIG).blend(joints, solved, target, IDENTITY, normal, 0.0, 0.0) is joints
    assert ArmBlend(RIG).blend(joints, solved, target, IDENTITY, normal, 1.0, 0.0) == RIG.solve(target, UP, normal)


@given(st.integers(0, len(POSES) - 1))
def test_small_weight_causes_a_small_change(index: int) -> None:
    joints = RIG.pose_joints(POSES[index].tolist())
    target = RIG.tip_target(joints)
    normal = vertical_normal(RIG.target_direction(target), UP)
    assert normal is not None
    blended = ArmBlend(RIG).blend(joints, solved_joints(target), target, IDENTITY, normal, 1e-6, 0.0)
    for a, b in zip(joints, blended, strict=True):
        assert abs(abs(sum(x * y for x, y in zip(a, b, strict=True))) - 1.0) < 1e-5
