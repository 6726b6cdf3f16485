"""Token buckets by key. The time is an argument, in seconds."""

from __future__ import annotations

from collections import OrderedDict

from bunraku.runtime.token_bucket import TokenBucket


class KeyedTokenBuckets:
    """Token bucket per key, for at most `max_keys` keys. An evicted key starts again with a full bucket."""

    def __init__(self, rate: float, burst: float, max_keys: int = 10_000) -> None:
        self._rate, self._burst, self._max_keys = rate, burst, max_keys
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()

    def take(self, key: str, now: float) -> bool:
        """Take a token of `key`. Return False if there is none."""
        bucket = self._buckets.get(key)
        if bucket is None:
            self._evict(now)
            bucket = self._buckets[key] = TokenBucket(self._rate, self._burst, now)
        self._buckets.move_to_end(key)
        return bucket.take(now)

    def _evict(self, now: float) -> None:
        """Remove the least recently used buckets that are full, and as many as necessary to stay within `max_keys`."""
        while self._buckets and (
            len(self._buckets) >= self._max_keys or next(iter(self._buckets.values())).is_full(now)
        ):
            self._buckets.popitem(last=False)
