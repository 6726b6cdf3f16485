"""Token buckets: so much a second, and so much at once. They read no clock: time comes in, seconds."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict


class Bucket:
    """One who may do something `rate` times a second, and `most` times at once."""

    __slots__ = ("_at", "_left", "_most", "_rate")

    def __init__(self, rate: float, most: float, now: float = 0.0) -> None:
        self._rate, self._most = rate, most
        self._left, self._at = most, now

    def take(self, now: float) -> bool:
        """Whether one more is allowed."""
        self._fill(now)
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True

    def full(self, now: float) -> bool:
        """Whether it is as if nothing had been taken."""
        self._fill(now)
        return self._left >= self._most

    def _fill(self, now: float) -> None:
        self._left = min(self._left + max(now - self._at, 0.0) * self._rate, self._most)
        self._at = max(now, self._at)


class Buckets:
    """A bucket for each of many; of `kept` at most. Whose is not kept any more has a full one."""

    def __init__(self, rate: float, most: float, kept: int = 10_000) -> None:
        self._rate, self._most, self._kept = rate, most, kept
        self._buckets: OrderedDict[str, Bucket] = OrderedDict()

    def take(self, who: str, now: float) -> bool:
        """Whether one more of `who` is allowed."""
        bucket = self._buckets.get(who)
        if bucket is None:
            self._forget(now)
            bucket = self._buckets[who] = Bucket(self._rate, self._most, now)
        self._buckets.move_to_end(who)
        return bucket.take(now)

    def _forget(self, now: float) -> None:
        """Those of whom nothing was heard for long; where all have much to do, the oldest."""
        while self._buckets and (len(self._buckets) >= self._kept or next(iter(self._buckets.values())).full(now)):
            self._buckets.popitem(last=False)


def network(address: str) -> str:
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
