"""One-Euro filter for noisy input, such as a tracker or an unsteady hand.

Casiez, Roussel, Vogel: "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive Systems", CHI
2012. Slow movement is smoothed, fast movement is followed. The cutoff grows with the speed of the whole vector, so that
a smoothed movement keeps its direction. `web/src/input/one-euro.ts` is the same in TypeScript.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

MIN_SAMPLE_INTERVAL_S = 1e-6
"""Samples closer in time than this count as simultaneous."""


class _State(NamedTuple):
    seconds: float
    value: tuple[float, ...]
    speed: tuple[float, ...]


class OneEuro:
    """Filter of one vector over time; times are arguments.

    `min_cutoff` in Hz applies at rest: lower is steadier. `beta` in Hz per unit per second of speed: higher lags less.
    `derivative_cutoff` in Hz smooths the speed. The defaults suit positions in arm lengths.
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
        """Return the smoothed value of a sample at a time in seconds.

        The first sample and a constant pass unchanged. Times may be irregular; of several samples with the same or an
        earlier time, the last one replaces the others. Raises ValueError for values that are not finite, or another
        number of them.
        """
        if not (math.isfinite(seconds) and all(map(math.isfinite, values))):
            raise ValueError(f"a sample needs finite numbers and a time, not {list(values)} at {seconds}")
        if self._current is not None and len(values) != len(self._current.value):
            raise ValueError(f"a sample needs {len(self._current.value)} numbers as before, not {len(values)}")
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
        """Forget all samples: the next one is the first."""
        self._previous = self._current = None

    def _smooth(self, previous: _State, values: Sequence[float], seconds: float) -> _State:
        elapsed = seconds - previous.seconds
        speed_factor = _smoothing_factor(self.derivative_cutoff, elapsed)
        change = zip(previous.value, previous.speed, values, strict=True)
        speed = tuple(speed + speed_factor * ((new - old) / elapsed - speed) for old, speed, new in change)
        value_factor = _smoothing_factor(self.min_cutoff + self.beta * math.hypot(*speed), elapsed)
        # exact for a constant, to the last bit
        value = tuple(old + value_factor * (new - old) for old, new in zip(previous.value, values, strict=True))
        return _State(seconds, value, speed)


def _smoothing_factor(cutoff: float, elapsed: float) -> float:
    """Return the weight of a new sample in a low-pass filter with a cutoff in Hz, after `elapsed` seconds."""
    turned = 2 * math.pi * cutoff * elapsed
    return turned / (turned + 1)
