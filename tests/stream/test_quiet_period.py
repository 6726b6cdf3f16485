from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import cast

from bunraku.stream.flow_control import FlowControl
from bunraku.stream.quiet_period import (
    INITIAL_QUIET_PERIODS,
    MAX_QUIET_PERIOD_US,
    QUIET_INTERVAL_US,
    QUIET_MARGIN_US,
    QuietPeriod,
)


def busy_flow(busy: int, *, steady: bool = False, rate: float | None = 3_600.0) -> FlowControl:
    """A line that is through with what is on its way in `busy` microseconds."""
    window = SimpleNamespace(rate=rate, busy=lambda _: busy)
    return cast(FlowControl, SimpleNamespace(steady=steady, window=window))


def test_a_full_line_falls_still_for_as_long_as_it_takes_and_no_longer() -> None:
    hush = QuietPeriod()
    assert hush.start(10**9, busy_flow(40_000))
    assert hush.ends_at == 10**9 + 40_000 + QUIET_MARGIN_US
    endless = QuietPeriod()
    assert endless.start(10**9, busy_flow(10**7))
    assert endless.ends_at == 10**9 + MAX_QUIET_PERIOD_US


def test_one_that_is_still_anyhow_and_one_of_which_nothing_is_known_do_not() -> None:
    hush = QuietPeriod()
    assert not hush.start(10**9, busy_flow(0, steady=True))
    assert not hush.start(10**9, busy_flow(0, rate=None))
    assert hush.ends_at == 0


def test_it_is_seldom_and_at_first_less_so() -> None:
    hush, full = QuietPeriod(), busy_flow(20_000)
    begun = [now for now in range(10**9, 10**9 + 12 * QUIET_INTERVAL_US, 10_000) if hush.start(now, full)]
    apart = [after - before for before, after in pairwise(begun)]
    assert apart[:INITIAL_QUIET_PERIODS] == [QUIET_INTERVAL_US // 4] * INITIAL_QUIET_PERIODS
    assert set(apart[INITIAL_QUIET_PERIODS:]) == {QUIET_INTERVAL_US}
