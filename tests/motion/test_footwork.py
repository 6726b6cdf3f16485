from dataclasses import replace

import numpy as np
import pytest

from bunraku.motion import footwork, rotation
from bunraku.motion.footwork import FLOOR, Foot
from bunraku.motion.score import SIDES, Place, Side, Step
from bunraku.motion.skeleton import INDEX, standard_figure
from tests.motion.test_score import SCORE

FIGURE = standard_figure()
TIME = np.arange(0.0, 5.0, 1.0 / 240.0)
BEAT = TIME / SCORE.seconds_per_beat


def feet() -> dict[Side, Foot]:
    return {side: footwork.foot(SCORE, FIGURE, side, TIME) for side in SIDES}


@pytest.mark.parametrize("side", SIDES)
def test_a_planted_foot_is_flat_and_does_not_move(side: Side) -> None:
    foot = feet()[side]
    for begin, end in ((0.0, 1.5), (2.0, 3.58), (4.0, 5.5), (6.0, 8.0)):
        planted = (begin <= BEAT) & (end >= BEAT)
        assert np.ptp(foot.ankle[planted], axis=0).max() < 1e-9
        assert foot.ankle[planted, 1] == pytest.approx(0.0656)
        up = rotation.rotate(foot.orientation[planted], np.array([0.0, 1.0, 0.0]))
        assert np.allclose(up, [0.0, 1.0, 0.0])
        assert np.allclose(foot.toes[planted], 0.0)


def test_the_middle_of_the_sole_stands_where_the_step_says() -> None:
    foot = feet()["left"]
    for beat, place in ((0.5, SCORE.left), (3.0, Place(0.2, 0.0, 0.0)), (7.0, SCORE.left)):
        i = int(np.argmin(np.abs(BEAT - beat)))
        middle = foot.ankle[i] + rotation.rotate(foot.orientation[i], np.array([0.0, 0.0, footwork.MIDDLE]))
        assert middle[[0, 2]] == pytest.approx([place.x, place.z])
        assert np.degrees(foot.facing[i]) == pytest.approx(place.turn)


@pytest.mark.parametrize("stamp", [False, True])
def test_a_swinging_foot_rises_to_its_lift_and_no_point_of_the_sole_goes_through_the_floor(stamp: bool) -> None:
    step = Step(2, "left", Place(0.2, 0.0), swing=1.0, lift=0.08, stamp=stamp)
    score = replace(SCORE, steps=(step, *SCORE.steps[1:]))
    foot = footwork.foot(score, FIGURE, "left", TIME)
    toes = FIGURE.tips[INDEX["l_midtarsal"]]
    bent = rotation.multiply(foot.orientation, rotation.about_axis(0, -foot.toes))
    ball = np.array([0.0, FLOOR - 0.0656, 0.1104])
    sole = np.stack(
        [
            foot.ankle + rotation.rotate(foot.orientation, np.array([0.0, FLOOR - 0.0656, -footwork.HEEL])),
            foot.ankle + rotation.rotate(foot.orientation, ball),
            foot.ankle + rotation.rotate(foot.orientation, ball) + rotation.rotate(bent, toes),
        ]
    )
    clearance = sole[..., 1].min(axis=0) - FLOOR
    assert clearance.min() > -1e-9
    swinging = (BEAT > 1.0) & (BEAT < 2.0)
    assert clearance[swinging].max() == pytest.approx(0.08, abs=0.002)
    assert np.all(clearance[~swinging & (BEAT < 3.5)] < 1e-9)


def test_a_hop_takes_both_feet_off_the_floor_together() -> None:
    flying = (BEAT > 3.65) & (BEAT < 3.95)
    for foot in feet().values():
        assert foot.ankle[flying, 1].min() > 0.0656 + 0.003


def test_feet_have_no_jumps_of_speed() -> None:
    for foot in feet().values():
        speed = np.diff(foot.ankle, axis=0) * 240.0
        assert np.abs(speed).max() < 3.0
        assert np.abs(np.diff(speed, axis=0)).max() * 240.0 < 60.0
