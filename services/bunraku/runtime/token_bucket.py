"""Token-bucket rate limiter. It reads no clock; the time is an argument, in seconds."""

from __future__ import annotations


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

    def give_back(self) -> None:
        """Return a token that was taken for an action that is not limited after all."""
        self._tokens = min(self._tokens + 1.0, self._burst)

    def is_full(self, now: float) -> bool:
        """Return whether the bucket is in its initial state again."""
        self._refill(now)
        return self._tokens >= self._burst

    def _refill(self, now: float) -> None:
        self._tokens = min(self._tokens + max(now - self._refilled_at, 0.0) * self._rate, self._burst)
        self._refilled_at = max(now, self._refilled_at)
