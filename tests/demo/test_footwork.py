from dataclasses import replace

import numpy as np
import pytest

from bunraku.demo import footwork
from bunraku.demo.footwork import FLOOR_HEIGHT_M, FootTrack
from bunraku.demo.score import SIDES, FootPlacement, Side, Step
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure
from tests.demo.test_score import SCORE

FIGURE = standard_figure()
TIME = np.arange(0.0, 5.0, 1.0 / 240.0)
BEAT = TIME / SCORE.seconds_per_beat


def animate_feet() -> dict[Side, FootTrack]:
    return {side: footwork.animate_foot(SCORE, FIGURE, side, TIME) for side in SIDES}


@pytest.mark.parametrize("side", SIDES)
def test_a_planted_foot_is_flat_and_does_not_move(side: Side) -> None:
    foot = animate_feet()[side]
    for begin, end in ((0.0, 1.5), (2.0, 3.58), (4.0, 5.5), (6.0, 8.0)):
        planted = (begin <= BEAT) & (end >= BEAT)
        assert np.ptp(foot.ankle_position[planted], axis=0).max() < 1e-9
        assert foot.ankle_position[planted, 1] == pytest.approx(0.0656)
        up = rotation.rotate(foot.orientation[planted], np.array([0.0, 1.0, 0.0]))
        assert np.allclose(up, [0.0, 1.0, 0.0])
        assert np.allclose(foot.toe_bend[planted], 0.0)


def test_sole_centre_is_at_the_steps_position() -> None:
    foot = animate_feet()["left"]
    for beat, place in ((0.5, SCORE.left_foot), (3.0, FootPlacement(0.2, 0.0, 0.0)), (7.0, SCORE.left_foot)):
        i = int(np.argmin(np.abs(BEAT - beat)))
        middle = foot.ankle_position[i] + rotation.rotate(
            foot.orientation[i], np.array([0.0, 0.0, footwork.SOLE_CENTRE_OFFSET_M])
        )
        assert middle[[0, 2]] == pytest.approx([place.x, place.z])
        assert np.degrees(foot.facing[i]) == pytest.approx(place.turn)


@pytest.mark.parametrize("stamp", [False, True])
def test_swinging_foot_reaches_its_lift_above_the_floor(stamp: bool) -> None:
    step = Step(2, "left", FootPlacement(0.2, 0.0), swing_beats=1.0, lift=0.08, is_stamp=stamp)
    score = replace(SCORE, steps=(step, *SCORE.steps[1:]))
    foot = footwork.animate_foot(score, FIGURE, "left", TIME)
    toes = FIGURE.tips[JOINT_INDEX["l_midtarsal"]]
    bent = rotation.multiply(foot.orientation, rotation.from_coordinate_axis(0, -foot.toe_bend))
    ball = np.array([0.0, FLOOR_HEIGHT_M - 0.0656, 0.1104])
    sole = np.stack(
        [
            foot.ankle_position
            + rotation.rotate(foot.orientation, np.array([0.0, FLOOR_HEIGHT_M - 0.0656, -footwork.HEEL_OFFSET_M])),
            foot.ankle_position + rotation.rotate(foot.orientation, ball),
            foot.ankle_position + rotation.rotate(foot.orientation, ball) + rotation.rotate(bent, toes),
        ]
    )
    clearance = sole[..., 1].min(axis=0) - FLOOR_HEIGHT_M
    assert clearance.min() > -1e-9
    swinging = (BEAT > 1.0) & (BEAT < 2.0)
    assert clearance[swinging].max() == pytest.approx(0.08, abs=0.002)
    assert np.all(clearance[~swinging & (BEAT < 3.5)] < 1e-9)


def test_a_hop_takes_both_feet_off_the_floor_together() -> None:
    flying = (BEAT > 3.65) & (BEAT < 3.95)
    for foot in animate_feet().values():
        assert foot.ankle_position[flying, 1].min() > 0.0656 + 0.003


def test_feet_have_no_jumps_of_speed() -> None:
    for foot in animate_feet().values():
        speed = np.diff(foot.ankle_position, axis=0) * 240.0
        assert np.abs(speed).max() < 3.0
        assert np.abs(np.diff(speed, axis=0)).max() * 240.0 < 60.0
