"""Whether a stage works out every frame, or, where the machine has too much to do, every second."""

from __future__ import annotations

REDUCE_LATENESS_US = 6_000
"""Microseconds that messages are late by, of late: then every second frame is left to the viewers, who show what lies
between two."""
RESTORE_LATENESS_US = 1_500
"""Microseconds below which messages are in time again."""
RESTORE_TICKS = 300
"""Messages in time before all frames are tried again: some ten seconds."""
_SMOOTHING = 0.1


class FrameRateControl:
    """Of one stage while it is pulled at."""

    def __init__(self) -> None:
        self.is_full_rate = True
        """Whether every frame is to be worked out."""
        self._mean_lateness_us = 0.0
        self._punctual_ticks = 0

    def record_lateness(self, lateness_us: int) -> None:
        """A message was late by so much."""
        self._mean_lateness_us += _SMOOTHING * (lateness_us - self._mean_lateness_us)
        self._punctual_ticks = self._punctual_ticks + 1 if self._mean_lateness_us < RESTORE_LATENESS_US else 0
        if self._mean_lateness_us > REDUCE_LATENESS_US:
            self.is_full_rate = False
        elif self._punctual_ticks > RESTORE_TICKS:
            self.is_full_rate, self._punctual_ticks = True, 0
