from __future__ import annotations

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
