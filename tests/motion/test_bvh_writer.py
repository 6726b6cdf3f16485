import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.bvh_writer import euler_zxy

ANGLE = st.floats(-180.0, 180.0)


@given(ANGLE, ANGLE | st.sampled_from([-90.0, 90.0]), ANGLE)
def test_euler_angles_equal_the_quaternion(z: float, x: float, y: float) -> None:
    q = rotation_from_zxy(np.array([z, x, y]))
    angles = euler_zxy(q)
    assert abs(angles[1]) <= 90.0
    assert abs(np.sum(rotation_from_zxy(angles) * q)) == pytest.approx(1.0, abs=1e-9)


def rotation_from_zxy(zxy: rotation.Array) -> rotation.Array:
    z, x, y = (
        rotation.from_coordinate_axis(axis, np.radians(angle)) for axis, angle in zip((2, 0, 1), zxy, strict=True)
    )
    return rotation.multiply(rotation.multiply(z, x), y)
