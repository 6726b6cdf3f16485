from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette.marionettes import Marionettes
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal
from bunraku.marionette.solver.vector import JointRotations
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_INTERVAL_US = 16_667
ROOT = np.zeros(3)
POSES = [random_motion(90, seed) for seed in (3, 4, 5)]


def expect_grant(answer: LimbGrant | LimbRefusal) -> LimbGrant:
    assert isinstance(answer, LimbGrant)
    return answer


def test_marionettes_of_a_stage_are_independent() -> None:
    marionettes, singles = Marionettes([FIGURE] * 3), [Marionette(FIGURE) for _ in range(3)]
    controlled = {0: (0, 1), 5: (1, 1), 10: (2, 1)}
    # limb l of performer k has number 4 k + l
    limbs = {number: divmod(number, 4) for number in controlled}
    for number, (performer, limb) in limbs.items():
        assert expect_grant(marionettes.ownership.claim(number, "ada", 0)) == LimbGrant(number, 1)
        expect_grant(singles[performer].ownership.claim(limb, "ada", 0))
    for frame in range(90):
        now = frame * FRAME_INTERVAL_US
        for number, (performer, limb) in limbs.items():
            values = (0.5, 0.01 * frame, 0.3)
            outcome = marionettes.ownership.apply_input("ada", LimbInput(number, 1, 1, frame, now, values), now)
            assert outcome == singles[performer].ownership.apply_input(
                "ada", LimbInput(limb, 1, 1, frame, now, values), now
            )
        overlay = marionettes.compute_overlay([(ROOT, poses[frame]) for poses in POSES], now)
        assert set(overlay) == set(controlled)
        for number, (performer, _) in limbs.items():
            single_overlay = singles[performer].compute_overlay(POSES[performer][frame], now)
            assert single_overlay is not None
            assert overlay[number] == single_overlay.joints[0]


def test_limbs_of_all_performers_are_addressed_by_number() -> None:
    marionettes = Marionettes([FIGURE] * 2)
    assert marionettes.ownership.claim(8, "ada", 0) == LimbRefusal(8, None, "unknown")
    expect_grant(marionettes.ownership.claim(6, "ada", 0))
    assert marionettes.ownership.claim(6, "bo", 0) == LimbRefusal(6, "ada", "held")
    assert marionettes.ownership.ask(6, "bo", True, 0)
    assert not marionettes.ownership.ask(9, "bo", True, 0)
    assert marionettes.ownership.holders() == (None,) * 6 + ("ada", None)
    assert marionettes.ownership.asks()[6] == ("bo",)
    assert (
        marionettes.ownership.apply_input("bo", LimbInput(6, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    )
    assert (
        marionettes.ownership.apply_input("bo", LimbInput(12, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    )
    marionettes.ownership.keep_alive("ada", [6, 12], 400_000)
    assert marionettes.ownership.expire(600_000) == []
    assert marionettes.ownership.expire(900_000) == [(6, "ada")]
    assert marionettes.ownership.grant_free_limbs(900_000) == ([("bo", LimbGrant(6, 2))], True)
    assert not marionettes.ownership.release(6, "bo", 1, 900_000)
    assert not marionettes.ownership.release(12, "bo", 1, 900_000)
    assert marionettes.ownership.leave("bo", 900_000) == (6,)
    assert marionettes.ownership.holders() == (None,) * 8


def test_limbs_of_removed_performers_are_lost_and_epochs_never_repeat() -> None:
    marionettes = Marionettes([FIGURE] * 2)
    expect_grant(marionettes.ownership.claim(1, "ada", 0))
    assert expect_grant(marionettes.ownership.claim(5, "bo", 0)).epoch == 1
    assert marionettes.set_figures([FIGURE]) == [(5, "bo")]
    assert marionettes.ownership.holders() == (None, "ada", None, None)
    assert marionettes.ownership.claim(5, "bo", 0) == LimbRefusal(5, None, "unknown")
    assert marionettes.set_figures([FIGURE] * 4) == []
    assert marionettes.ownership.holders()[1] == "ada"
    assert expect_grant(marionettes.ownership.claim(5, "bo", 0)).epoch == 2
    assert Marionettes([FIGURE] * 3, marionettes.ownership.epochs).ownership.epochs == marionettes.ownership.epochs
    assert len(marionettes.ownership.epochs) == 16


@pytest.mark.parametrize("count", [0, 5])
def test_stage_has_one_to_four_performers(count: int) -> None:
    marionettes = Marionettes([FIGURE])
    with pytest.raises(ValueError, match="1 to 4"):
        marionettes.set_figures([FIGURE] * count)
    assert len(marionettes) == 4


def control_hand_and_leg(marionettes: Marionettes, begin: int) -> list[dict[int, JointRotations]]:
    """Control a hand and a leg with hand-over and loss, until all limbs are at rest; return the overlays."""
    shown = []
    grants = {}
    for frame in range(begin, begin + 160):
        now, phase = frame * FRAME_INTERVAL_US, frame - begin
        ownership = marionettes.ownership
        if phase == 2:
            grants = {limb: expect_grant(ownership.claim(limb, "ada", now)) for limb in (0, 3)}
            ownership.ask(0, "bo", True, now)
            for before in (frame - 2, frame - 1):
                marionettes.observe_poses([(ROOT, POSES[0][before % 160 % 90])], before * FRAME_INTERVAL_US)
        if 2 < phase < 30:
            for limb, grant in grants.items():
                values = (0.01 * phase, 0.2, 0.4)
                ownership.apply_input("ada", LimbInput(limb, phase % 2, grant.epoch, phase, now, values), now)
        if phase == 30:
            ownership.release(0, "ada", grants[0].epoch, now)
            assert ownership.grant_free_limbs(now)[0][0][0] == "bo"
        if 30 < phase < 50:
            ownership.keep_alive("bo", [0], now)
        ownership.expire(now)
        shown.append(marionettes.compute_overlay([(ROOT, POSES[0][frame % 160 % 90])], now))
    assert ownership.is_at_rest
    return shown


def test_same_commands_give_the_same_overlays_whatever_came_before() -> None:
    one, other = Marionettes([FIGURE]), Marionettes([FIGURE])
    first = control_hand_and_leg(one, 0)
    assert any(first)
    assert control_hand_and_leg(other, 0) == first
    # at rest a marionette has no memory
    assert control_hand_and_leg(one, 320) == control_hand_and_leg(Marionettes([FIGURE]), 320)
