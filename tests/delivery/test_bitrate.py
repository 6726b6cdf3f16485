from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.bitrate import BitrateSelector
from bunraku.wire.messages import Report

SECOND_US = 1_000_000


def report_repeatedly(selector: BitrateSelector, report: Report, seconds: int, start: int = 0) -> int:
    for second in range(seconds):
        selector.process_report(report, (start + second) * SECOND_US)
    return selector.level


def test_empty_buffer_lowers_level_and_full_buffer_raises_it() -> None:
    selector = BitrateSelector(4)
    assert selector.level == 3
    assert report_repeatedly(selector, Report(buffer=200_000), 8) == 0
    assert report_repeatedly(selector, Report(buffer=3_900_000), 30, start=8) == 3


def test_level_is_stable_with_medium_buffer() -> None:
    selector = BitrateSelector(4)
    report_repeatedly(selector, Report(buffer=0), 2)
    before = selector.level
    assert report_repeatedly(selector, Report(buffer=1_500_000), 60, start=5) == before


def test_slow_machine_lowers_level_on_fast_link() -> None:
    assert report_repeatedly(BitrateSelector(4), Report(buffer=3_900_000, frame=90_000), 10) == 0
    assert report_repeatedly(BitrateSelector(4), Report(buffer=3_900_000, decode=40_000), 10) == 0


def test_background_page_gets_lowest_level_until_visible() -> None:
    selector = BitrateSelector(4)
    assert report_repeatedly(selector, Report(buffer=3_900_000, hidden=True), 3) == 0
    assert report_repeatedly(selector, Report(buffer=3_900_000), 1, start=3) == 3


def test_pinned_level_is_constant_and_clamped() -> None:
    assert report_repeatedly(BitrateSelector(4, pinned=2), Report(buffer=0), 9) == 2
    assert BitrateSelector(4, pinned=99).level == 3


def test_background_page_and_slow_machine_keep_audio() -> None:
    selector = BitrateSelector(6, initial=4, fallback=1)
    assert selector.level == 4
    assert selector.process_report(Report(buffer=3_000_000, hidden=True), 0) == 1
    assert selector.process_report(Report(buffer=3_000_000), 1) == 4
    clock = 0
    for _ in range(20):
        clock += 2_000_000
        selector.process_report(Report(buffer=3_000_000, frame=90_000), clock)
    assert selector.level == 1
    # a link that is too slow drops audio as well
    assert selector.process_report(Report(buffer=0, frame=90_000), clock + 2_000_000) == 0
    assert selector.process_report(Report(buffer=3_000_000, hidden=True), clock + 3_000_000) == 0


BITRATES_KBPS = (0.5, 1.2, 2.1, 3.4, 6.4)


def feed_throughput(
    selector: BitrateSelector, bps: float, seconds: int, *, shares_with_overlays: bool = False, start: int = 0
) -> int:
    for second in range(seconds):
        selector.update_throughput(bps / 8, (start + second) * SECOND_US, shares_with_overlays)
    return selector.level


def test_level_follows_throughput_of_constrained_link() -> None:
    selector = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    assert (selector.level, selector.reason, selector.throughput_bps) == (4, "best", None)
    assert feed_throughput(selector, 28_800, 10) == 4
    assert feed_throughput(selector, 4_000, 20, start=10) == 2
    assert selector.reason == "line"
    assert abs((selector.throughput_bps or 0) - 4_000) < 300
    assert feed_throughput(selector, 300, 20, start=30) == 0
    selector.update_throughput(None, 60 * SECOND_US, False)
    assert f"{selector.level} {selector.reason} {selector.throughput_bps}" == "4 best None"


def test_controlled_limbs_lower_level() -> None:
    selector = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    assert feed_throughput(selector, 28_800, 5, shares_with_overlays=True) == 2
    assert selector.reason == "hands"
    assert feed_throughput(BitrateSelector(5, bitrates_kbps=BITRATES_KBPS), 14_400, 5, shares_with_overlays=True) == 0


def test_slowdown_lowers_level_at_once_while_overlays_share_link() -> None:
    for shares, levels in ((True, [3, 0, 0]), (False, [4, 3, 4])):
        selector = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
        assert [
            feed_throughput(selector, 56_000, 5, shares_with_overlays=shares),
            feed_throughput(selector, 7_000, 1, shares_with_overlays=shares, start=5),
            feed_throughput(selector, 28_800, 1, shares_with_overlays=shares, start=6),
        ] == levels


@given(st.lists(st.floats(100, 1e6), min_size=1, max_size=60))
def test_level_costs_at_most_maximum_throughput(throughputs: list[float]) -> None:
    selector = BitrateSelector(5, bitrates_kbps=BITRATES_KBPS)
    for second, bps in enumerate(throughputs):
        selector.update_throughput(bps / 8, second * SECOND_US, False)
        assert selector.level == 0 or BITRATES_KBPS[selector.level] * 1000 <= max(throughputs)


def test_reasons_of_levels() -> None:
    assert BitrateSelector(4, pinned=1).reason == "pinned"
    assert BitrateSelector(4, initial=1).reason == "start"
    hidden, slow, late = BitrateSelector(4), BitrateSelector(4), BitrateSelector(4)
    report_repeatedly(hidden, Report(buffer=3_900_000, hidden=True), 3)
    report_repeatedly(slow, Report(buffer=3_900_000, frame=90_000), 3)
    report_repeatedly(late, Report(buffer=0), 3)
    assert [selector.reason for selector in (hidden, slow, late)] == ["hidden", "machine", "buffer"]
