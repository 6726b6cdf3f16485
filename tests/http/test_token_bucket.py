from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.http.token_bucket import KeyedTokenBuckets, TokenBucket, client_network


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


def test_keys_have_separate_buckets_and_their_number_is_limited() -> None:
    buckets = KeyedTokenBuckets(1, 2, max_keys=3)
    assert [buckets.take("a", 0.0) for _ in range(3)] == [True, True, False]
    assert buckets.take("b", 0.0)
    assert not buckets.take("a", 0.5)
    for key in "cdef":
        assert buckets.take(key, 0.5)
    # above the limit the least recently used key is evicted
    assert len(buckets._buckets) == 3
    # full buckets are evicted as well
    assert buckets.take("g", 100.0)
    assert len(buckets._buckets) == 1


@pytest.mark.parametrize(
    ("address", "network"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("2001:db8:1:2:ffff::1", "2001:db8:1:2::"),
        ("a pipe", "a pipe"),
    ],
)
def test_client_network_groups_ipv6_addresses(address: str, network: str) -> None:
    assert client_network(address) == network
