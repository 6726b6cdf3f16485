from __future__ import annotations

import pytest

from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import Grant, Input, Outcome, Refusal
from bunraku.marionette.troupe import Troupe
from bunraku.motion.skeleton import standard_figure
from tests.marionette.arms import dance

FIGURE = standard_figure()
FRAME = 16_667
POSES = [dance(90, seed) for seed in (3, 4, 5)]


def granted(answer: Grant | Refusal) -> Grant:
    assert isinstance(answer, Grant)
    return answer


def test_each_puppet_is_as_if_it_were_alone() -> None:
    troupe, alone = Troupe([FIGURE] * 3), [Marionette(FIGURE) for _ in range(3)]
    pulled = {0: (0, 1), 5: (1, 1), 10: (2, 1)}
    # a hand of the first, the other hand of the second, a leg of the third: limb l of performer k is 4 k + l
    limbs = {number: divmod(number, 4) for number in pulled}
    for number, (nth, limb) in limbs.items():
        assert granted(troupe.claim(number, "ada", 0)) == Grant(number, 1)
        granted(alone[nth].claim(limb, "ada", 0))
    for frame in range(90):
        now = frame * FRAME
        for number, (nth, limb) in limbs.items():
            values = (0.5, 0.01 * frame, 0.3)
            said = troupe.input("ada", Input(number, 1, 1, frame, now, values), now)
            assert said == alone[nth].input("ada", Input(limb, 1, 1, frame, now, values), now)
        laid = troupe.overlay([poses[frame] for poses in POSES], now)
        assert set(laid) == set(pulled)
        for number, (nth, _) in limbs.items():
            over = alone[nth].overlay(POSES[nth][frame], now)
            assert over is not None
            assert laid[number] == over.joints[0]


def test_limbs_of_all_are_held_asked_for_and_lost_by_their_number() -> None:
    troupe = Troupe([FIGURE] * 2)
    assert troupe.claim(8, "ada", 0) == Refusal(8, None, "unknown")
    granted(troupe.claim(6, "ada", 0))
    assert troupe.claim(6, "bo", 0) == Refusal(6, "ada", "held")
    assert troupe.ask(6, "bo", True, 0)
    assert not troupe.ask(9, "bo", True, 0)
    assert troupe.holders() == (None,) * 6 + ("ada", None)
    assert troupe.asks()[6] == ("bo",)
    assert troupe.input("bo", Input(6, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is Outcome.OWNER
    assert troupe.input("bo", Input(12, 0, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is Outcome.OWNER
    troupe.alive("ada", [6, 12], 400_000)
    assert troupe.expire(600_000) == []
    assert troupe.expire(900_000) == [(6, "ada")]
    assert troupe.settle(900_000) == ([("bo", Grant(6, 2))], True)
    assert not troupe.release(6, "bo", 1, 900_000)
    assert not troupe.release(12, "bo", 1, 900_000)
    assert troupe.leave("bo", 900_000) == (6,)
    assert troupe.holders() == (None,) * 8


def test_who_goes_takes_their_limbs_with_them_and_an_epoch_never_comes_again() -> None:
    troupe = Troupe([FIGURE] * 2)
    granted(troupe.claim(1, "ada", 0))
    assert granted(troupe.claim(5, "bo", 0)).epoch == 1
    assert troupe.set_figures([FIGURE]) == [(5, "bo")]
    assert troupe.holders() == (None, "ada", None, None)
    assert troupe.claim(5, "bo", 0) == Refusal(5, None, "unknown")
    assert troupe.set_figures([FIGURE] * 4) == []
    assert troupe.holders()[1] == "ada"
    assert granted(troupe.claim(5, "bo", 0)).epoch == 2
    assert Troupe([FIGURE] * 3, troupe.epochs).epochs == troupe.epochs
    assert len(troupe.epochs) == 16


@pytest.mark.parametrize("count", [0, 5])
def test_a_stage_has_one_to_four(count: int) -> None:
    troupe = Troupe([FIGURE])
    with pytest.raises(ValueError, match="1 to 4"):
        troupe.set_figures([FIGURE] * count)
    assert len(troupe) == 4
