import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bunraku.demo import mass
from bunraku.motion import rotation, skeleton
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, standard_figure

FIGURE = standard_figure()
REST = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


def posed_centre_of_mass(rotations: Array) -> Array:
    return mass.centre_of_mass(skeleton.joint_and_tip_positions(FIGURE, FIGURE.offsets[0], rotations))


def test_masses_sum_to_one() -> None:
    assert np.isclose(mass.POINT_WEIGHTS.sum(), 1.0)
    assert np.all(mass.POINT_WEIGHTS >= 0.0)


def test_standing_body_balances_over_its_feet() -> None:
    x, y, z = posed_centre_of_mass(REST)
    # 55 to 58 per cent of the height is where bodies are measured to balance (Winter); the figure stands on -.014
    assert 0.55 < (y + 0.014) / 1.764 < 0.58
    assert abs(x) < 0.003
    assert -0.0736 < z < 0.0368


@given(arrays(np.float64, 3, elements=st.floats(-5, 5)))
def test_centre_of_mass_moves_with_the_body(way: Array) -> None:
    points = skeleton.joint_and_tip_positions(FIGURE, FIGURE.offsets[0], REST)
    assert np.allclose(mass.centre_of_mass(points + way), mass.centre_of_mass(points) + way)


def test_raised_arm_lifts_the_centre_of_mass() -> None:
    raised = REST.copy()
    raised[JOINT_INDEX["l_shoulder"]] = rotation.from_coordinate_axis(2, np.array(np.pi))
    rise = posed_centre_of_mass(raised)[1] - posed_centre_of_mass(REST)[1]
    # twice the arm's 5 per cent, times the distance of the arm's centre from the shoulder: 27 to 35 cm
    assert 0.05 * 2 * 0.27 < rise < 0.05 * 2 * 0.35
