"""Frame rate of a stage: every frame, or every second one on an overloaded machine."""

from __future__ import annotations

REDUCE_LATENESS_US = 6_000
"""Mean lateness above which every second frame is skipped; viewers interpolate it."""
RESTORE_LATENESS_US = 1_500
"""Mean lateness below which a tick counts as punctual."""
RESTORE_TICKS = 300
"""Punctual ticks before the full rate is restored: about ten seconds."""
_SMOOTHING = 0.1


class FrameRateControl:
    """Frame rate of one stage while limbs are controlled."""

    def __init__(self) -> None:
        self.is_full_rate = True
        """True if every frame is computed."""
        self._mean_lateness_us = 0.0
        self._punctual_ticks = 0

    def record_lateness(self, lateness_us: int) -> None:
        """Record the lateness of a tick."""
        self._mean_lateness_us += _SMOOTHING * (lateness_us - self._mean_lateness_us)
        self._punctual_ticks = self._punctual_ticks + 1 if self._mean_lateness_us < RESTORE_LATENESS_US else 0
        if self._mean_lateness_us > REDUCE_LATENESS_US:
            self.is_full_rate = False
        elif self._punctual_ticks > RESTORE_TICKS:
            self.is_full_rate, self._punctual_ticks = True, 0
