"""Token buckets: so much a second, and so much at once. They read no clock: time comes in, seconds."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict


class TokenBucket:
    """One who may do something `rate` times a second, and `most` times at once."""

    __slots__ = ("_burst", "_rate", "_refilled_at", "_tokens")

    def __init__(self, rate: float, burst: float, now: float = 0.0) -> None:
        self._rate, self._burst = rate, burst
        self._tokens, self._refilled_at = burst, now

    def take(self, now: float) -> bool:
        """Whether one more is allowed."""
        self._refill(now)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True

    def is_full(self, now: float) -> bool:
        """Whether it is as if nothing had been taken."""
        self._refill(now)
        return self._tokens >= self._burst

    def _refill(self, now: float) -> None:
        self._tokens = min(self._tokens + max(now - self._refilled_at, 0.0) * self._rate, self._burst)
        self._refilled_at = max(now, self._refilled_at)


class KeyedTokenBuckets:
    """A bucket for each of many; of `kept` at most. Whose is not kept any more has a full one."""

    def __init__(self, rate: float, burst: float, max_keys: int = 10_000) -> None:
        self._rate, self._burst, self._max_keys = rate, burst, max_keys
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()

    def take(self, key: str, now: float) -> bool:
        """Whether one more of `who` is allowed."""
        bucket = self._buckets.get(key)
        if bucket is None:
            self._evict(now)
            bucket = self._buckets[key] = TokenBucket(self._rate, self._burst, now)
        self._buckets.move_to_end(key)
        return bucket.take(now)

    def _evict(self, now: float) -> None:
        """Those of whom nothing was heard for long; where all have much to do, the oldest."""
        while self._buckets and (
            len(self._buckets) >= self._max_keys or next(iter(self._buckets.values())).is_full(now)
        ):
            self._buckets.popitem(last=False)


def client_network(address: str) -> str:
    """Whom an address belongs to: itself, or of IPv6 the network of 64 bits, which is one house's."""
    try:
        found = ipaddress.ip_address(address)
    except ValueError:
        return address
    if found.version == 6:
        if found.ipv4_mapped is not None:
            return str(found.ipv4_mapped)
        return str(ipaddress.ip_network((found, 64), strict=False).network_address)
    return str(found)
