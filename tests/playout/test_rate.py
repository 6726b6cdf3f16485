from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.rate import RateChoice
from bunraku.wire.messages import Report

SECOND = 1_000_000


def run(choice: RateChoice, report: Report, seconds: int, start: int = 0) -> int:
    for second in range(seconds):
        choice.report(report, (start + second) * SECOND)
    return choice.rate


def test_an_empty_buffer_brings_the_lowest_rate_and_a_full_one_the_highest_again() -> None:
    choice = RateChoice(4)
    assert choice.rate == 3
    assert run(choice, Report(buffer=200_000), 8) == 0
    assert run(choice, Report(buffer=3_900_000), 30, start=8) == 3


def test_it_does_not_swing_when_all_is_well_enough() -> None:
    choice = RateChoice(4)
    run(choice, Report(buffer=0), 2)
    before = choice.rate
    assert run(choice, Report(buffer=1_500_000), 60, start=5) == before


def test_a_slow_machine_gets_less_however_good_its_line() -> None:
    assert run(RateChoice(4), Report(buffer=3_900_000, frame=90_000), 10) == 0
    assert run(RateChoice(4), Report(buffer=3_900_000, decode=40_000), 10) == 0


def test_a_hidden_tab_gets_the_lowest_rate_and_its_own_back() -> None:
    choice = RateChoice(4)
    assert run(choice, Report(buffer=3_900_000, hidden=True), 3) == 0
    assert run(choice, Report(buffer=3_900_000), 1, start=3) == 3


def test_a_pinned_rate_stays_and_is_kept_within_those_there_are() -> None:
    assert run(RateChoice(4, pinned=2), Report(buffer=0), 9) == 2
    assert RateChoice(4, pinned=99).rate == 3


def test_who_does_not_look_still_hears_and_a_slow_machine_does_not_silence_it() -> None:
    choice = RateChoice(6, first=4, safe=1)
    assert choice.rate == 4
    assert choice.report(Report(buffer=3_000_000, hidden=True), 0) == 1
    assert choice.report(Report(buffer=3_000_000), 1) == 4
    clock = 0
    for _ in range(20):
        clock += 2_000_000
        choice.report(Report(buffer=3_000_000, frame=90_000), clock)
    assert choice.rate == 1
    # a line that does not carry it is another matter
    assert choice.report(Report(buffer=0, frame=90_000), clock + 2_000_000) == 0
    assert choice.report(Report(buffer=3_000_000, hidden=True), clock + 3_000_000) == 0


COSTS = (0.5, 1.2, 2.1, 3.4, 6.4)


def carried(choice: RateChoice, bps: float, seconds: int, *, beside: bool = False, start: int = 0) -> int:
    for second in range(seconds):
        choice.line(bps / 8, (start + second) * SECOND, beside)
    return choice.rate


def test_a_narrow_line_gets_what_it_carries_and_is_told_so() -> None:
    choice = RateChoice(5, costs=COSTS)
    assert (choice.rate, choice.reason, choice.carried) == (4, "best", None)
    assert carried(choice, 28_800, 10) == 4
    assert carried(choice, 4_000, 20, start=10) == 2
    assert choice.reason == "line"
    assert abs((choice.carried or 0) - 4_000) < 300
    assert carried(choice, 300, 20, start=30) == 0
    choice.line(None, 60 * SECOND, False)
    assert f"{choice.rate} {choice.reason} {choice.carried}" == "4 best None"


def test_hands_go_before_a_finer_dance() -> None:
    choice = RateChoice(5, costs=COSTS)
    assert carried(choice, 28_800, 5, beside=True) == 2
    assert choice.reason == "hands"
    assert carried(RateChoice(5, costs=COSTS), 14_400, 5, beside=True) == 0


def test_beside_hands_a_line_that_has_become_slower_gets_a_coarser_dance_at_once() -> None:
    for beside, rates in ((True, [3, 0, 0]), (False, [4, 3, 4])):
        choice = RateChoice(5, costs=COSTS)
        assert [
            carried(choice, 56_000, 5, beside=beside),
            carried(choice, 7_000, 1, beside=beside, start=5),
            carried(choice, 28_800, 1, beside=beside, start=6),
        ] == rates


@given(st.lists(st.floats(100, 1e6), min_size=1, max_size=60))
def test_what_is_chosen_costs_no_more_than_the_most_that_the_line_carried(rates: list[float]) -> None:
    choice = RateChoice(5, costs=COSTS)
    for second, bps in enumerate(rates):
        choice.line(bps / 8, second * SECOND, False)
        assert choice.rate == 0 or COSTS[choice.rate] * 1000 <= max(rates)


def test_every_choice_has_its_reason() -> None:
    assert RateChoice(4, pinned=1).reason == "pinned"
    assert RateChoice(4, first=1).reason == "start"
    hidden, slow, late = RateChoice(4), RateChoice(4), RateChoice(4)
    run(hidden, Report(buffer=3_900_000, hidden=True), 3)
    run(slow, Report(buffer=3_900_000, frame=90_000), 3)
    run(late, Report(buffer=0), 3)
    assert [choice.reason for choice in (hidden, slow, late)] == ["hidden", "machine", "buffer"]
