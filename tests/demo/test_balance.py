from dataclasses import replace

import numpy as np
import pytest

from bunraku.demo import balance
from bunraku.demo.footwork import GRAVITY_M_S2
from tests.demo.test_score import SCORE

TIME = np.arange(0.0, 5.0, 1.0 / 240.0)
BEAT = TIME / SCORE.seconds_per_beat


def test_hips_face_between_the_feet_and_return() -> None:
    facing = np.degrees(balance.hip_facing(SCORE, TIME))
    assert facing[0] == 0.0
    assert facing[np.argmin(np.abs(BEAT - 3.0))] == pytest.approx(-4.0)
    assert facing[-1] == pytest.approx(0.0)


def test_weight_is_over_the_standing_foot_during_a_step() -> None:
    weight = balance.weight_target(SCORE, TIME)
    for begin, end in ((1.5, 2.0), (5.5, 6.0)):
        stepping = (begin <= BEAT) & (end >= BEAT)
        assert np.abs(weight[stepping] - [SCORE.right_foot.x, SCORE.right_foot.z]).max() < 0.035


def test_weight_starts_and_ends_between_the_feet() -> None:
    weight = balance.weight_target(SCORE, TIME)
    assert weight[0] == pytest.approx([0.0, 0.0])
    assert weight[-1] == pytest.approx([0.0, 0.0])
    assert np.abs(np.diff(weight, 2, axis=0)).max() * 240.0**2 < 12.0


def test_body_falls_freely_in_a_hop() -> None:
    leap = balance.hop_height(SCORE, TIME)
    flying = (BEAT > 3.6) & (BEAT < 3.98)
    fall = np.diff(leap[flying], 2) * 240.0**2
    assert fall == pytest.approx(-GRAVITY_M_S2, rel=1e-6)
    flight = 0.42 * SCORE.seconds_per_beat
    assert leap.max() == pytest.approx(GRAVITY_M_S2 * flight**2 / 8.0, rel=1e-3)
    assert leap.min() < -0.05
    assert leap[0] == leap[-1] == 0.0


def test_hop_height_is_zero_without_hops() -> None:
    score = replace(SCORE, hops=())
    assert not balance.hop_height(score, TIME).any()
