"""The One-Euro filter for noisy sources: a tracker, a shaking hand.

Casiez, Roussel, Vogel: "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive Systems", CHI
2012. Slow movement is smoothed, fast movement is followed. The cutoff grows with the speed of the whole vector, so that
a smoothed movement keeps its direction. `web/src/input/one-euro.ts` is the same in TypeScript.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

MIN_SAMPLE_INTERVAL_S = 1e-6
"""Samples nearer in time than this are of one time, seconds."""


class _State(NamedTuple):
    seconds: float
    value: tuple[float, ...]
    speed: tuple[float, ...]


class OneEuro:
    """The filter of one vector over time. It reads no clock: times come in.

    `min_cutoff`, Hz, at rest: lower is steadier. `beta`, Hz for each unit a second of speed: higher lags less.
    `derivative_cutoff`, Hz, of the speed's own smoothing. The defaults suit places in arm lengths.
    """

    def __init__(self, min_cutoff: float = 1.5, beta: float = 8.0, derivative_cutoff: float = 1.0) -> None:
        if not (min_cutoff > 0 and beta >= 0 and derivative_cutoff > 0):
            raise ValueError("cutoffs are above zero, and beta is zero or more")
        self.min_cutoff = min_cutoff
        self.beta = beta
        self.derivative_cutoff = derivative_cutoff
        self._previous: _State | None = None
        self._current: _State | None = None

    def filter(self, values: Sequence[float], seconds: float) -> tuple[float, ...]:
        """The smoothed value of a sample at a time.

        The first comes through as it is, and so does a constant. Times may be irregular; of several samples of one
        time, or of an earlier one, the last counts as if it were the only one. Raises `ValueError` for a number that is
        not finite, or another number of them than before.
        """
        if not (math.isfinite(seconds) and all(map(math.isfinite, values))):
            raise ValueError(f"a sample is finite numbers and a time, not {list(values)} at {seconds}")
        if self._current is not None and len(values) != len(self._current.value):
            raise ValueError(f"a sample had {len(self._current.value)} numbers before, and has {len(values)} now")
        if self._current is not None:
            if seconds - self._current.seconds >= MIN_SAMPLE_INTERVAL_S:
                self._previous = self._current
            else:
                seconds = self._current.seconds
        if self._previous is None:
            self._current = _State(seconds, tuple(map(float, values)), (0.0,) * len(values))
        else:
            self._current = self._smooth(self._previous, values, seconds)
        return self._current.value

    def reset(self) -> None:
        """Forget what came: the next sample is the first."""
        self._previous = self._current = None

    def _smooth(self, before: _State, values: Sequence[float], seconds: float) -> _State:
        passed = seconds - before.seconds
        slow = _smoothing_factor(self.derivative_cutoff, passed)
        change = zip(before.value, before.speed, values, strict=True)
        speed = tuple(speed + slow * ((new - old) / passed - speed) for old, speed, new in change)
        much = _smoothing_factor(self.min_cutoff + self.beta * math.hypot(*speed), passed)
        # written so that a constant comes through to the last bit
        value = tuple(old + much * (new - old) for old, new in zip(before.value, values, strict=True))
        return _State(seconds, value, speed)


def _smoothing_factor(cutoff: float, elapsed: float) -> float:
    """What a new sample weighs in a low-pass of a cutoff in Hz, after some seconds."""
    turned = 2 * math.pi * cutoff * elapsed
    return turned / (turned + 1)
