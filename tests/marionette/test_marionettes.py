from __future__ import annotations

import pytest

from bunraku.marionette.marionettes import Marionettes
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_INTERVAL_US = 16_667
POSES = [random_motion(90, seed) for seed in (3, 4, 5)]


def expect_grant(answer: LimbGrant | LimbRefusal) -> LimbGrant:
    assert isinstance(answer, LimbGrant)
    return answer


def test_marionettes_of_a_stage_are_independent() -> None:
    troupe, alone = Marionettes([FIGURE] * 3), [Marionette(FIGURE) for _ in range(3)]
    pulled = {0: (0, 1), 5: (1, 1), 10: (2, 1)}
    # a hand of the first, the other hand of the second, a leg of the third: limb l of performer k is 4 k + l
    limbs = {number: divmod(number, 4) for number in pulled}
    for number, (nth, limb) in limbs.items():
        assert expect_grant(troupe.ownership.claim(number, "ada", 0)) == LimbGrant(number, 1)
        expect_grant(alone[nth].ownership.claim(limb, "ada", 0))
    for frame in range(90):
        now = frame * FRAME_INTERVAL_US
        for number, (nth, limb) in limbs.items():
            values = (0.5, 0.01 * frame, 0.3)
            said = troupe.ownership.apply_input("ada", LimbInput(number, 1, 1, frame, now, values), now)
            assert said == alone[nth].ownership.apply_input("ada", LimbInput(limb, 1, 1, frame, now, values), now)
        laid = troupe.compute_overlay([poses[frame] for poses in POSES], now)
        assert set(laid) == set(pulled)
        for number, (nth, _) in limbs.items():
            over = alone[nth].compute_overlay(POSES[nth][frame], now)
            assert over is not None
            assert laid[number] == over.joints[0]


def test_limbs_of_all_are_held_asked_for_and_lost_by_their_number() -> None:
    troupe = Marionettes([FIGURE] * 2)
    assert troupe.ownership.claim(8, "ada", 0) == LimbRefusal(8, None, "unknown")
    expect_grant(troupe.ownership.claim(6, "ada", 0))
    assert troupe.ownership.claim(6, "bo", 0) == LimbRefusal(6, "ada", "held")
    assert troupe.ownership.ask(6, "bo", True, 0)
    assert not troupe.ownership.ask(9, "bo", True, 0)
    assert troupe.ownership.holders() == (None,) * 6 + ("ada", None)
    assert troupe.ownership.asks()[6] == ("bo",)
    assert troupe.ownership.apply_input("bo", LimbInput(6, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    assert troupe.ownership.apply_input("bo", LimbInput(12, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    troupe.ownership.keep_alive("ada", [6, 12], 400_000)
    assert troupe.ownership.expire(600_000) == []
    assert troupe.ownership.expire(900_000) == [(6, "ada")]
    assert troupe.ownership.grant_free_limbs(900_000) == ([("bo", LimbGrant(6, 2))], True)
    assert not troupe.ownership.release(6, "bo", 1, 900_000)
    assert not troupe.ownership.release(12, "bo", 1, 900_000)
    assert troupe.ownership.leave("bo", 900_000) == (6,)
    assert troupe.ownership.holders() == (None,) * 8


def test_limbs_of_removed_performers_are_lost_and_epochs_never_repeat() -> None:
    troupe = Marionettes([FIGURE] * 2)
    expect_grant(troupe.ownership.claim(1, "ada", 0))
    assert expect_grant(troupe.ownership.claim(5, "bo", 0)).epoch == 1
    assert troupe.set_figures([FIGURE]) == [(5, "bo")]
    assert troupe.ownership.holders() == (None, "ada", None, None)
    assert troupe.ownership.claim(5, "bo", 0) == LimbRefusal(5, None, "unknown")
    assert troupe.set_figures([FIGURE] * 4) == []
    assert troupe.ownership.holders()[1] == "ada"
    assert expect_grant(troupe.ownership.claim(5, "bo", 0)).epoch == 2
    assert Marionettes([FIGURE] * 3, troupe.ownership.epochs).ownership.epochs == troupe.ownership.epochs
    assert len(troupe.ownership.epochs) == 16


@pytest.mark.parametrize("count", [0, 5])
def test_stage_has_one_to_four_performers(count: int) -> None:
    troupe = Marionettes([FIGURE])
    with pytest.raises(ValueError, match="1 to 4"):
        troupe.set_figures([FIGURE] * count)
    assert len(troupe) == 4
