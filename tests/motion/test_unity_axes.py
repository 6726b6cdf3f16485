import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.unity_axes import from_xyzw, mirror_rotations, mirror_vectors, to_xyzw

ANGLES = st.floats(-3.0, 3.0)
VECTORS = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


@given(st.tuples(ANGLES, ANGLES, ANGLES), VECTORS)
def test_rotating_commutes_with_the_conversion(turn: tuple[float, ...], vector: tuple[float, ...]) -> None:
    q, v = rotation.from_rotation_vector(np.array(turn)), np.array(vector)
    # in a left-handed frame the formula q v q* turns the other way, which the mirrored quaternion compensates
    np.testing.assert_allclose(
        mirror_vectors(rotation.rotate(q, v)), rotation.rotate(mirror_rotations(q), mirror_vectors(v)), atol=1e-12
    )
    np.testing.assert_allclose(mirror_rotations(mirror_rotations(q)), q)


def test_known_turn_of_unity() -> None:
    # Unity's Quaternion.Euler(0, 90, 0) is (x 0, y 0.7071, z 0, w 0.7071) and turns forward (z) to the figure's right
    turned = mirror_rotations(from_xyzw(np.array([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)])))
    np.testing.assert_allclose(rotation.rotate(turned, np.array([0.0, 0.0, 1.0])), [-1.0, 0.0, 0.0], atol=1e-12)


def test_order_of_components() -> None:
    q = np.array([1.0, 2.0, 3.0, 4.0])
    assert from_xyzw(q).tolist() == [4.0, 1.0, 2.0, 3.0]
    assert to_xyzw(from_xyzw(q)).tolist() == q.tolist()
