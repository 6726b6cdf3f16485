"""Judgement of heartbeats: who is still there, by the observer's own clock.

The one rule for everything that a replica holds: a heartbeat is a value that changes, and has stopped when the observer
has seen the same value for the timeout. No time that another machine has written is compared.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping

MAX_GAP = 0.8
"""Longest time between two observations, as a share of the timeout, after which silence still counts."""


class HeartbeatObserver:
    """Observer of the heartbeats of many holders. It reads no clock: times are arguments, in seconds."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        # by holder: the last value, and the time of the observation that first saw it
        self._seen: dict[str, tuple[Hashable, float]] = {}
        self.last_observation_s: float | None = None

    def observe(self, heartbeats: Mapping[str, Hashable], now_s: float) -> None:
        """Record the present value of every holder; others are forgotten.

        After an outage or a stall of the observer itself, everybody gets as much time again.
        """
        last_s, self.last_observation_s = self.last_observation_s, now_s
        was_blind = last_s is None or now_s - last_s > MAX_GAP * self._timeout_s
        self._seen = {
            holder: (value, now_s if was_blind or self._last_value(holder) != value else self._seen[holder][1])
            for holder, value in heartbeats.items()
        }

    def is_known(self, holder: str) -> bool:
        """Return whether the last observation contained a holder."""
        return holder in self._seen

    def has_stopped(self, holder: str) -> bool:
        """Return whether a known holder has been silent for longer than the timeout."""
        return self.silence_s(holder) > self._timeout_s

    def silence_s(self, holder: str) -> float:
        """Return the time from the first to the last observation of a known holder's value."""
        assert self.last_observation_s is not None
        return self.last_observation_s - self._seen[holder][1]

    def _last_value(self, holder: str) -> Hashable:
        return self._seen[holder][0] if holder in self._seen else None
