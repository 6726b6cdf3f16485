"""Extension of input timeouts by the time for which the event loop was blocked."""

from __future__ import annotations

from bunraku.marionette.ownership import INPUT_TIMEOUT_US

STALL_THRESHOLD_US = INPUT_TIMEOUT_US // 4
"""Lateness of a tick from which the event loop counts as blocked."""


class EventLoopStallCompensation:
    """Stall compensation of one stage. Times are clock time in microseconds."""

    def __init__(self) -> None:
        self._stalled_us = 0
        self._valid_until_us = 0

    def compensate(self, lateness_us: int, now: int) -> int:
        """Record the lateness of a tick at `now` and return the time by which to extend the input timeouts.

        Messages sent during a stall wait in socket buffers and are received over the next ticks. So a stall counts for
        the duration of an input timeout.
        """
        extension_us = self._stalled_us if now < self._valid_until_us else 0
        if lateness_us > STALL_THRESHOLD_US:
            extension_us = self._stalled_us = extension_us + lateness_us
            self._valid_until_us = now + INPUT_TIMEOUT_US
        return max(lateness_us, extension_us, 0)
