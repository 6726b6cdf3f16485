from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import cast

from bunraku.stream.flow_control import FlowControl, LinkState
from bunraku.stream.quiet_period import (
    INITIAL_QUIET_PERIODS,
    MAX_QUIET_PERIOD_US,
    QUIET_INTERVAL_US,
    QUIET_MARGIN_US,
    QuietPeriod,
)

START = 10**9


def busy_flow(
    drain_us: int, *, state: LinkState = LinkState.HIGH_RTT_LIMITED, throughput: float | None = 3_600.0
) -> FlowControl:
    """Return flow control of a link that drains in `drain_us` microseconds."""
    window = SimpleNamespace(throughput=throughput, time_to_drain=lambda _: drain_us)
    return cast(FlowControl, SimpleNamespace(state=state, window=window))


def test_quiet_period_lasts_until_link_has_drained() -> None:
    quiet_period = QuietPeriod()
    assert quiet_period.start(START, busy_flow(40_000))
    assert quiet_period.ends_at == START + 40_000 + QUIET_MARGIN_US
    bounded = QuietPeriod()
    assert bounded.start(START, busy_flow(10**7))
    assert bounded.ends_at == START + MAX_QUIET_PERIOD_US


def test_unconstrained_or_unmeasured_link_has_no_quiet_period() -> None:
    quiet_period = QuietPeriod()
    assert not quiet_period.start(START, busy_flow(0, state=LinkState.HIGH_RTT))
    assert not quiet_period.start(START, busy_flow(0, state=LinkState.UNLIMITED))
    assert not quiet_period.start(START, busy_flow(0, throughput=None))
    assert quiet_period.ends_at == 0


def test_first_quiet_periods_have_shorter_interval() -> None:
    quiet_period, flow = QuietPeriod(), busy_flow(20_000)
    starts = [now for now in range(START, START + 12 * QUIET_INTERVAL_US, 10_000) if quiet_period.start(now, flow)]
    intervals = [after - before for before, after in pairwise(starts)]
    assert intervals[:INITIAL_QUIET_PERIODS] == [QUIET_INTERVAL_US // 4] * INITIAL_QUIET_PERIODS
    assert set(intervals[INITIAL_QUIET_PERIODS:]) == {QUIET_INTERVAL_US}
