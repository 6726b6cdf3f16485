"""Play-out delay on simulated links."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.delay import MAX_DELAY_US, MAX_GROWTH_RATE, PlayoutDelay

FRAME_INTERVAL_US = 33_334
OVERLAY_LEAD_US = 26_666
NOISE = np.random.default_rng(4).random(2_000)


def late_share(network_delay: Callable[[int], float], seconds: float, after: float) -> tuple[float, float]:
    """Return the share of late messages from second `after` on, and the final delay.

    `network_delay` gives the delay of the nth message in microseconds.
    """
    delay = PlayoutDelay()
    sent = [
        (nth * FRAME_INTERVAL_US, round(nth * FRAME_INTERVAL_US + network_delay(nth)))
        for nth in range(int(seconds * 1e6 / FRAME_INTERVAL_US))
    ]
    late = []
    for begun, at in sorted(sent, key=lambda message: message[1]):
        needed = begun + OVERLAY_LEAD_US
        if at > after * 1e6:
            late.append(at - delay.at(at) > needed)
        delay.add_lateness(at - needed, at)
    return sum(late) / len(late), delay.at(round(seconds * 1e6))


def test_fast_link_has_no_delay() -> None:
    assert late_share(lambda nth: 2_000 + 3_000 * NOISE[nth], 10, 0) == (0, 0)


@pytest.mark.parametrize(
    "network_delay",
    [
        lambda nth: 90_000 + 0 * nth,
        lambda nth: 40_000 + 80_000 * NOISE[nth],
        lambda nth: 20_000 - 25_000 * np.log(1 - NOISE[nth]),
        lambda nth: 150_000 if nth % 40 < 2 else 30_000,
    ],
    ids=["slow", "jittery", "long tails", "stalls"],
)
def test_nearly_all_messages_are_in_time_on_slow_link(network_delay: Callable[[int], float]) -> None:
    late, delay = late_share(network_delay, 40, 10)
    assert late <= 0.05
    assert 10_000 < delay < 160_000


def test_delay_shrinks_when_link_recovers() -> None:
    assert late_share(lambda nth: 150_000 if nth < 300 else 5_000, 70, 0)[1] < 1_000


def test_single_old_message_has_no_effect() -> None:
    delay = PlayoutDelay()
    delay.add_lateness(90_000, 0)
    for nth in range(1, 60):
        delay.add_lateness(-20_000, nth * FRAME_INTERVAL_US)
        assert delay.at(nth * FRAME_INTERVAL_US) == 0


def test_delay_is_constant_without_messages() -> None:
    delay = PlayoutDelay()
    for nth in range(300):
        delay.add_lateness(50_000, nth * FRAME_INTERVAL_US)
    assert delay.at(10_000_000) == delay.at(3_600_000_000) == 60_000


@given(st.lists(st.tuples(st.integers(0, 200_000), st.integers(-100_000, 900_000)), min_size=30, max_size=200))
def test_delay_slews_and_is_bounded(messages: list[tuple[int, int]]) -> None:
    delay, local, before = PlayoutDelay(), 0, 0.0
    for passed, late in messages:
        local += passed
        shown = delay.at(local)
        assert abs(shown - before) <= MAX_GROWTH_RATE * passed + 1e-6
        assert 0 <= shown <= MAX_DELAY_US
        delay.add_lateness(late, local)
        assert delay.at(local) == pytest.approx(shown, abs=1e-6)
        before = shown
