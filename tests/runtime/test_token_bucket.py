from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.runtime.token_bucket import TokenBucket


@given(
    rate=st.floats(0.5, 100),
    burst=st.floats(1, 100),
    waits=st.lists(st.floats(0, 5), max_size=200),
)
def test_taken_tokens_never_exceed_burst_plus_rate(rate: float, burst: float, waits: list[float]) -> None:
    bucket, now, granted = TokenBucket(rate, burst), 0.0, 0
    for wait in waits:
        now += wait
        granted += bucket.take(now)
        assert granted <= burst + rate * now + 1e-6


def test_burst_is_available_at_once_then_the_rate() -> None:
    bucket = TokenBucket(10, 5, now=100.0)
    assert sum(bucket.take(100.0) for _ in range(20)) == 5
    assert not bucket.take(100.05)
    assert bucket.take(100.15)
    assert not bucket.is_full(100.2)
    assert bucket.is_full(200.0)
    # a clock that steps back adds no tokens
    assert bucket.take(150.0)
    assert sum(bucket.take(0.0) for _ in range(20)) == 4


def test_token_that_is_given_back_can_be_taken_again() -> None:
    bucket = TokenBucket(1, 3)
    assert sum(bucket.take(0.0) for _ in range(10)) == 3
    bucket.give_back()
    assert sum(bucket.take(0.0) for _ in range(10)) == 1
    # never more than the burst
    for _ in range(10):
        bucket.give_back()
    assert sum(bucket.take(0.0) for _ in range(10)) == 3
