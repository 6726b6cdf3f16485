import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bunraku.demo import two_bone_ik
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure

FIGURE = standard_figure()
LIMBS = [
    (FIGURE.offsets[JOINT_INDEX[middle]], FIGURE.offsets[JOINT_INDEX[end]], hinge)
    for middle, end, hinge in (
        ("l_knee", "l_ankle", two_bone_ik.KNEE_SIGN),
        ("r_knee", "r_ankle", two_bone_ik.KNEE_SIGN),
        ("l_elbow", "l_wrist", two_bone_ik.ELBOW_SIGN),
        ("r_elbow", "r_wrist", two_bone_ik.ELBOW_SIGN),
    )
]
DIRECTIONS = arrays(np.float64, 3, elements=st.floats(-1, 1))


def end_positions(upper: Array, lower: Array, turned: Array, bend: Array, hinge: float) -> Array:
    return rotation.rotate(turned, upper + rotation.rotate(rotation.from_coordinate_axis(0, hinge * bend), lower))


@pytest.mark.parametrize(("upper", "lower", "hinge"), LIMBS)
@given(direction=DIRECTIONS, pole=DIRECTIONS, share=st.floats(0, 1))
def test_end_reaches_target_and_hinge_points_to_pole(
    upper: Array, lower: Array, hinge: float, direction: Array, pole: Array, share: float
) -> None:
    assume(np.linalg.norm(direction) > 0.1)
    assume(np.linalg.norm(np.cross(rotation.normalise(direction), pole)) > 0.05)
    near, far = (
        two_bone_ik.end_distance(upper, lower, hinge * np.radians(150.0)),
        two_bone_ik.end_distance(upper, lower),
    )
    target = rotation.normalise(direction) * (near + share * (far - near))
    turned, bend = two_bone_ik.solve_two_bone(upper, lower, target[None], pole[None], hinge)
    assert np.allclose(end_positions(upper, lower, turned, bend, hinge), target, rtol=0, atol=1e-9)
    assert 0.0 <= bend[0] <= np.radians(150.0) + 1e-6
    # the hinge is on the pole's side of the straight path to the target
    beside = pole - target * (pole @ target) / (target @ target)
    assert rotation.rotate(turned[0], upper) @ beside > 0.0


@pytest.mark.parametrize(("upper", "lower", "hinge"), LIMBS)
def test_rest_pose_needs_no_rotation(upper: Array, lower: Array, hinge: float) -> None:
    # the hinge's own x is square to this pole, so that rest is the solution
    pole = np.cross(upper + lower, [1.0, 0.0, 0.0])[None] * hinge
    turned, bend = two_bone_ik.solve_two_bone(upper, lower, (upper + lower)[None], pole, hinge)
    assert np.allclose(np.abs(turned), rotation.IDENTITY, rtol=0, atol=1e-6)
    assert np.allclose(bend, 0.0, rtol=0, atol=1e-6)


@pytest.mark.parametrize(("upper", "lower", "hinge"), LIMBS)
def test_target_out_of_reach_is_met_in_direction(upper: Array, lower: Array, hinge: float) -> None:
    target = np.array([[0.3, -2.0, 0.4], [0.003, -0.02, 0.004]])
    turned, bend = two_bone_ik.solve_two_bone(upper, lower, target, np.array([[0.0, 0.0, hinge]] * 2), hinge)
    end = end_positions(upper, lower, turned, bend, hinge)
    assert np.allclose(rotation.normalise(end), rotation.normalise(target), rtol=0, atol=1e-9)
    assert np.degrees(bend) == pytest.approx([0.0, 150.0], abs=1e-4)
