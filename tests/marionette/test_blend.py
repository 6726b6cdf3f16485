from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import vector
from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.elbow import elevation, vertical_normal
from bunraku.marionette.limbs import ArmRig, Joints, Limb
from bunraku.marionette.vector import IDENTITY
from bunraku.motion.skeleton import standard_figure
from tests.marionette.arms import dance

RIG = ArmRig(standard_figure(), Limb.LEFT_HAND)
POSES = dance(200, seed=8)
UP = (0.0, 1.0, 0.0)


def bent(target: vector.Vector) -> Joints:
    reach = RIG.arm.clamp(vector.length(target))
    return RIG.bend(reach, RIG.arm.bend(reach, elevation(RIG.direction(target), UP)))


@given(st.integers(0, len(POSES) - 1), st.floats(0.0, 1.0))
def test_the_same_place_is_kept_from_the_dances_way_to_the_marionettes(index: int, weight: float) -> None:
    """The dance's own hand tip as the target: at every weight the tip stays there."""
    joints = RIG.dance(POSES[index].tolist())
    target = RIG.target(joints)
    if vector.length(target) > 0.97 or vector.length(target) < 0.3:
        return  # a straight arm reaches less as its wrist bends
    normal = vertical_normal(RIG.direction(target), UP)
    assert normal is not None
    mixed = ArmBlend(RIG).joints(joints, bent(target), target, IDENTITY, normal, weight, 0.0)
    np.testing.assert_allclose(RIG.target(mixed), target, atol=1e-9)


@given(st.integers(0, len(POSES) - 1))
def test_both_ends_are_exact(index: int) -> None:
    joints = RIG.dance(POSES[index].tolist())
    target = vector.scale(vector.unit(RIG.target(joints), UP), 0.6)
    normal = vertical_normal(RIG.direction(target), UP)
    assert normal is not None
    hung = bent(target)
    assert ArmBlend(RIG).joints(joints, hung, target, IDENTITY, normal, 0.0, 0.0) is joints
    assert ArmBlend(RIG).joints(joints, hung, target, IDENTITY, normal, 1.0, 0.0) == RIG.hang(target, UP, normal)


@given(st.integers(0, len(POSES) - 1))
def test_a_small_weight_is_a_small_change(index: int) -> None:
    joints = RIG.dance(POSES[index].tolist())
    target = RIG.target(joints)
    normal = vertical_normal(RIG.direction(target), UP)
    assert normal is not None
    mixed = ArmBlend(RIG).joints(joints, bent(target), target, IDENTITY, normal, 1e-6, 0.0)
    for a, b in zip(joints, mixed, strict=True):
        assert abs(abs(sum(x * y for x, y in zip(a, b, strict=True))) - 1.0) < 1e-5
