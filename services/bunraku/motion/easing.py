"""Easing functions, and tracks composed of eased moves.

A track is the sum of moves, each with its own start and duration; where they overlap the body flows through a key
instead of stopping there (superposition of submovements: Flash and Henis 1991, "Arm trajectory modifications during
reaching towards visual targets").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bunraku.motion.rotation import Array

EasingFunction = Callable[[Array], Array]


def minimum_jerk(u: Array) -> Array:
    """Ease from 0 to 1 for `u` from 0 to 1, at rest at both ends (Flash and Hogan 1985); constant outside."""
    u = np.clip(u, 0.0, 1.0)
    eased: Array = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return eased


def ease_out(u: Array) -> Array:
    """Ease from 0 to 1 with a sharp start and a soft end: speed 20 u (1 - u)^3, maximal at u = 1/4."""
    u = np.clip(u, 0.0, 1.0)
    eased: Array = u * u * (10.0 + u * (-20.0 + u * (15.0 - 4.0 * u)))
    return eased


def ease_in(u: Array) -> Array:
    """Ease from 0 to 1 with a soft start and a sharp end, the reverse of `ease_out`."""
    eased: Array = 1.0 - ease_out(1.0 - np.asarray(u))
    return eased


@dataclass(frozen=True, slots=True)
class EasedMove:
    """Change by `delta` (k,) that starts at `start` and takes `duration` > 0, both in seconds."""

    start: float
    duration: float
    delta: Array
    ease: EasingFunction = minimum_jerk


def superpose(time: Array, start: Array, moves: Sequence[EasedMove]) -> Array:
    """Return the track (n, k) over `time` (n,) seconds that starts at `start` (k,) and adds all `moves`."""
    track = np.tile(np.asarray(start, dtype=np.float64), (len(time), 1))
    for move in moves:
        track += move.ease((time - move.start) / move.duration)[:, None] * move.delta
    return track


def bump(time: Array, begin: float, peak: float, end: float) -> Array:
    """Rise (n,) from 0 at `begin` to 1 at `peak` and fall to 0 at `end`, in seconds, at rest at all three."""
    return minimum_jerk((time - begin) / (peak - begin)) - minimum_jerk((time - peak) / (end - peak))


def hermite(time: Array, knots: Array, values: Array, slopes: Array) -> Array:
    """Evaluate the cubic Hermite spline (n,) through `values` (m,) with `slopes` (m,) at ascending `knots` (m,)
    seconds.

    Outside the knots the first and the last value are constant.
    """
    i = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    span = knots[i + 1] - knots[i]
    u = np.clip((time - knots[i]) / span, 0.0, 1.0)
    spline: Array = (
        (1 + 2 * u) * (1 - u) ** 2 * values[i]
        + u * (1 - u) ** 2 * span * slopes[i]
        + u * u * (3 - 2 * u) * values[i + 1]
        + u * u * (u - 1) * span * slopes[i + 1]
    )
    return spline
