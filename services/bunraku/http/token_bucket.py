"""Token-bucket rate limiters. They read no clock; the time is an argument, in seconds."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict


class TokenBucket:
    """Limiter to `rate` actions per second and `burst` actions at once."""

    __slots__ = ("_burst", "_rate", "_refilled_at", "_tokens")

    def __init__(self, rate: float, burst: float, now: float = 0.0) -> None:
        self._rate, self._burst = rate, burst
        self._tokens, self._refilled_at = burst, now

    def take(self, now: float) -> bool:
        """Take a token. Return False if there is none."""
        self._refill(now)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True

    def is_full(self, now: float) -> bool:
        """Return whether the bucket is in its initial state again."""
        self._refill(now)
        return self._tokens >= self._burst

    def _refill(self, now: float) -> None:
        self._tokens = min(self._tokens + max(now - self._refilled_at, 0.0) * self._rate, self._burst)
        self._refilled_at = max(now, self._refilled_at)


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


def client_network(address: str) -> str:
    """Return the rate-limiting key of an address: an IPv4 address itself, the /64 network of an IPv6 address."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if parsed.version == 6:
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return str(ipaddress.ip_network((parsed, 64), strict=False).network_address)
    return str(parsed)
