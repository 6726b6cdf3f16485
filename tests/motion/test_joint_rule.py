from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.joint_rule import JointRule, aim_at

DOWN = np.array([0.0, -1.0, 0.0])


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


def test_rule_has_one_origin() -> None:
    with pytest.raises(ValueError, match="one of"):
        JointRule()
    with pytest.raises(ValueError, match="one of"):
        JointRule(source=1, copied=2)
