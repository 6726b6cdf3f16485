from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.limb_fit import DOWN, aim_at, rotation_to_hanging

DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: sum(x * x for x in v) > 0.01)


@given(bone=DIRECTION)
def test_every_bone_is_rotated_straight_down(bone: tuple[float, float, float]) -> None:
    there = rotation.normalise(np.array(bone))
    np.testing.assert_allclose(rotation.rotate(rotation_to_hanging(there), there), DOWN, atol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_t_pose_arm_lowers_about_z_with_palm_to_the_thigh(side: float) -> None:
    turn = rotation_to_hanging(np.array([side, 0.0, 0.0]))
    np.testing.assert_allclose(turn, rotation.from_coordinate_axis(2, np.array(-side * np.pi / 2)), atol=1e-12)
    # the palm of a T-pose faces the floor
    np.testing.assert_allclose(rotation.rotate(turn, DOWN), [-side, 0.0, 0.0], atol=1e-12)


@given(seed=st.integers(0, 10_000))
def test_aiming_points_the_offset_at_the_target(seed: int) -> None:
    random = np.random.default_rng(seed)
    orientation = rotation.from_rotation_vector(random.uniform(-2.0, 2.0, (9, 3)))
    start, target = random.normal(0.0, 1.0, (2, 9, 3))
    turned = aim_at(orientation, DOWN, start, target)
    np.testing.assert_allclose(rotation.rotate(turned, DOWN), rotation.normalise(target - start), atol=1e-7)


def test_target_at_the_joint_rotates_nothing() -> None:
    orientation = rotation.from_rotation_vector(np.array([[0.3, 0.2, 0.1]]))
    np.testing.assert_allclose(aim_at(orientation, DOWN, np.ones((1, 3)), np.ones((1, 3))), orientation, atol=1e-12)
