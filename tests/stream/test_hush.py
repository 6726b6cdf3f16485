from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import cast

from bunraku.stream.flow import Flow
from bunraku.stream.hush import EVERY, FIRST, LONGER, MOST, Hush


def line(busy: int, *, steady: bool = False, rate: float | None = 3_600.0) -> Flow:
    """A line that is through with what is on its way in `busy` microseconds."""
    window = SimpleNamespace(rate=rate, busy=lambda _: busy)
    return cast(Flow, SimpleNamespace(steady=steady, window=window))


def test_a_full_line_falls_still_for_as_long_as_it_takes_and_no_longer() -> None:
    hush = Hush()
    assert hush.begin(10**9, line(40_000))
    assert hush.until == 10**9 + 40_000 + LONGER
    endless = Hush()
    assert endless.begin(10**9, line(10**7))
    assert endless.until == 10**9 + MOST


def test_one_that_is_still_anyhow_and_one_of_which_nothing_is_known_do_not() -> None:
    hush = Hush()
    assert not hush.begin(10**9, line(0, steady=True))
    assert not hush.begin(10**9, line(0, rate=None))
    assert hush.until == 0


def test_it_is_seldom_and_at_first_less_so() -> None:
    hush, full = Hush(), line(20_000)
    begun = [now for now in range(10**9, 10**9 + 12 * EVERY, 10_000) if hush.begin(now, full)]
    apart = [after - before for before, after in pairwise(begun)]
    assert apart[:FIRST] == [EVERY // 4] * FIRST
    assert set(apart[FIRST:]) == {EVERY}
