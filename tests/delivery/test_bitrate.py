from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.bitrate import BitrateSelector
from bunraku.wire.messages import Report

SECOND = 1_000_000


def report_repeatedly(choice: BitrateSelector, report: Report, seconds: int, start: int = 0) -> int:
    for second in range(seconds):
        choice.process_report(report, (start + second) * SECOND)
    return choice.level


def test_an_empty_buffer_brings_the_lowest_rate_and_a_full_one_the_highest_again() -> None:
    choice = BitrateSelector(4)
    assert choice.level == 3
    assert report_repeatedly(choice, Report(buffer=200_000), 8) == 0
    assert report_repeatedly(choice, Report(buffer=3_900_000), 30, start=8) == 3


def test_it_does_not_swing_when_all_is_well_enough() -> None:
    choice = BitrateSelector(4)
    report_repeatedly(choice, Report(buffer=0), 2)
    before = choice.level
    assert report_repeatedly(choice, Report(buffer=1_500_000), 60, start=5) == before


def test_a_slow_machine_gets_less_however_good_its_line() -> None:
    assert report_repeatedly(BitrateSelector(4), Report(buffer=3_900_000, frame=90_000), 10) == 0
    assert report_repeatedly(BitrateSelector(4), Report(buffer=3_900_000, decode=40_000), 10) == 0


def test_a_hidden_tab_gets_the_lowest_rate_and_its_own_back() -> None:
    choice = BitrateSelector(4)
    assert report_repeatedly(choice, Report(buffer=3_900_000, hidden=True), 3) == 0
    assert report_repeatedly(choice, Report(buffer=3_900_000), 1, start=3) == 3


def test_a_pinned_rate_stays_and_is_kept_within_those_there_are() -> None:
    assert report_repeatedly(BitrateSelector(4, pinned=2), Report(buffer=0), 9) == 2
    assert BitrateSelector(4, pinned=99).level == 3


def test_who_does_not_look_still_hears_and_a_slow_machine_does_not_silence_it() -> None:
    choice = BitrateSelector(6, initial=4, fallback=1)
    assert choice.level == 4
    assert choice.process_report(Report(buffer=3_000_000, hidden=True), 0) == 1
    assert choice.process_report(Report(buffer=3_000_000), 1) == 4
    clock = 0
    for _ in range(20):
        clock += 2_000_000
        choice.process_report(Report(buffer=3_000_000, frame=90_000), clock)
    assert choice.level == 1
    # a line that does not carry it is another matter
    assert choice.process_report(Report(buffer=0, frame=90_000), clock + 2_000_000) == 0
    assert choice.process_report(Report(buffer=3_000_000, hidden=True), clock + 3_000_000) == 0


BITRATES_KBPS = (0.5, 1.2, 2.1, 3.4, 6.4)


def feed_throughput(
    choice: BitrateSelector, bps: float, seconds: int, *, shares_with_overlays: bool = False, start: int = 0
) -> int:
    for second in range(seconds):
        choice.update_throughput(bps / 8, (start + second) * SECOND, shares_with_overlays)
    return choice.level


def test_a_narrow_line_gets_what_it_carries_and_is_told_so() -> None:
    choice = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    assert (choice.level, choice.reason, choice.throughput_bps) == (4, "best", None)
    assert feed_throughput(choice, 28_800, 10) == 4
    assert feed_throughput(choice, 4_000, 20, start=10) == 2
    assert choice.reason == "line"
    assert abs((choice.throughput_bps or 0) - 4_000) < 300
    assert feed_throughput(choice, 300, 20, start=30) == 0
    choice.update_throughput(None, 60 * SECOND, False)
    assert f"{choice.level} {choice.reason} {choice.throughput_bps}" == "4 best None"


def test_hands_go_before_a_finer_dance() -> None:
    choice = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    assert feed_throughput(choice, 28_800, 5, shares_with_overlays=True) == 2
    assert choice.reason == "hands"
    assert feed_throughput(BitrateSelector(5, bitrates_kbps=BITRATES_KBPS), 14_400, 5, shares_with_overlays=True) == 0


def test_beside_hands_a_line_that_has_become_slower_gets_a_coarser_dance_at_once() -> None:
    for beside, rates in ((True, [3, 0, 0]), (False, [4, 3, 4])):
        choice = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
        assert [
            feed_throughput(choice, 56_000, 5, shares_with_overlays=beside),
            feed_throughput(choice, 7_000, 1, shares_with_overlays=beside, start=5),
            feed_throughput(choice, 28_800, 1, shares_with_overlays=beside, start=6),
        ] == rates


@given(st.lists(st.floats(100, 1e6), min_size=1, max_size=60))
def test_what_is_chosen_costs_no_more_than_the_most_that_the_line_carried(rates: list[float]) -> None:
    choice = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    for second, bps in enumerate(rates):
        choice.update_throughput(bps / 8, second * SECOND, False)
        assert choice.level == 0 or BITRATES_KBPS[choice.level] * 1000 <= max(rates)


def test_every_choice_has_its_reason() -> None:
    assert BitrateSelector(4, pinned=1).reason == "pinned"
    assert BitrateSelector(4, initial=1).reason == "start"
    hidden, slow, late = BitrateSelector(4), BitrateSelector(4), BitrateSelector(4)
    report_repeatedly(hidden, Report(buffer=3_900_000, hidden=True), 3)
    report_repeatedly(slow, Report(buffer=3_900_000, frame=90_000), 3)
    report_repeatedly(late, Report(buffer=0), 3)
    assert [choice.reason for choice in (hidden, slow, late)] == ["hidden", "machine", "buffer"]
