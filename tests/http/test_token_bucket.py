from __future__ import annotations

from bunraku.http.token_bucket import KeyedTokenBuckets


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
