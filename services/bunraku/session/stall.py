"""Time in which nobody could be heard, as the process stood still: it is not the silence of those who hold limbs."""

from __future__ import annotations

from bunraku.marionette.ownership import INPUT_TIMEOUT_US

STALL_THRESHOLD_US = INPUT_TIMEOUT_US // 4
"""A message later than this many microseconds is so because nothing went on here."""


class EventLoopStallCompensation:
    """Of one stage. Times are clock time in microseconds."""

    def __init__(self) -> None:
        self._stalled_us = 0
        self._valid_until_us = 0

    def compensate(self, lateness_us: int, now: int) -> int:
        """A message was late by so much; how much of everyone's silence until `now` is not theirs.

        What was said meanwhile waits at sockets and is heard after some more messages: so time that was lost counts for
        as long as one may be silent.
        """
        before = self._stalled_us if now < self._valid_until_us else 0
        if lateness_us > STALL_THRESHOLD_US:
            before = self._stalled_us = before + lateness_us
            self._valid_until_us = now + INPUT_TIMEOUT_US
        return max(lateness_us, before, 0)
