import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.demo import mass, stance
from bunraku.demo.footwork import FootTrack
from bunraku.demo.score import Side
from bunraku.motion import rotation, skeleton
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, standard_figure

FIGURE = standard_figure()


def standing_feet(spread: float, turn: float) -> dict[Side, FootTrack]:
    angle = np.array([turn])
    feet: dict[Side, FootTrack] = {}
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        ankle = rotation.rotate(rotation.from_coordinate_axis(1, angle), np.array([sign * spread, 0.0656, -0.06]))
        feet["left" if side == "left" else "right"] = FootTrack(
            ankle, rotation.from_coordinate_axis(1, angle), np.zeros(1), angle
        )
    return feet


@settings(max_examples=60)
@given(
    spread=st.floats(0.06, 0.3),
    turn=st.floats(-3, 3),
    depth=st.floats(0.0, 0.3),
    bow=st.floats(-0.2, 1.0),
    sway=st.floats(-0.05, 0.05),
)
def test_both_feet_are_reached_under_the_weight(
    spread: float, turn: float, depth: float, bow: float, sway: float
) -> None:
    rotations = np.tile(rotation.IDENTITY, (1, JOINT_COUNT, 1))
    rotations[:, 0] = rotation.from_coordinate_axis(1, np.array([turn]))
    rotations[:, JOINT_INDEX["vl5"]] = rotation.from_coordinate_axis(0, np.array([bow]))
    feet = standing_feet(spread, turn)
    weight = np.array([[sway, 0.0]])
    height = np.array([FIGURE.offsets[0, 1] - depth])
    root = stance.solve_stance(FIGURE, rotations, feet, np.array([turn]), height, weight)
    points = skeleton.joint_and_tip_positions(FIGURE, root, rotations)
    for side, foot in feet.items():
        assert np.allclose(points[:, JOINT_INDEX[f"{side[0]}_ankle"]], foot.ankle_position, rtol=0, atol=1e-6)
        knee = rotation.to_rotation_vector(rotations[:, JOINT_INDEX[f"{side[0]}_knee"]])
        assert knee[0, 1:] == pytest.approx([0.0, 0.0])
        assert 0.0 < knee[0, 0] < np.radians(150.0)
    assert np.allclose(mass.centre_of_mass(points)[:, [0, 2]], weight, rtol=0, atol=1e-3)
    assert root[0, 1] <= height[0]


def test_low_hips_keep_the_given_height() -> None:
    rotations = np.tile(rotation.IDENTITY, (1, JOINT_COUNT, 1))
    height = np.array([0.7])
    root = stance.solve_stance(FIGURE, rotations, standing_feet(0.1, 0.0), np.zeros(1), height, np.zeros((1, 2)))
    assert root[0, 1] == pytest.approx(0.7, abs=1e-5)
