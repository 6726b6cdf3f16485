from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.limb_fit import DOWN, rotation_to_hanging

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
