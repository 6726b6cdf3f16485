"""Measured points of other codecs (`peers.json`: clip, codec, rows of kbit/s, mean error, max error, ...)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

Rows = list[list[float]]
MEAN, MAX = 1, 2
CURVE_SAMPLES = 48
"""Number of points of a curve."""


def load_peer_results(corpus: Path) -> dict[str, dict[str, Rows]]:
    """Return the rows by clip and codec; raise FileNotFoundError."""
    peers: dict[str, dict[str, Rows]] = json.loads((corpus / "peers.json").read_text(encoding="utf-8"))
    return peers


def lower_hull(rows: Rows, column: int) -> list[tuple[float, float]]:
    """Return the lower hull of (error mm, kbit/s): the best that mixing settings of a codec over time could reach."""
    points: list[tuple[float, float]] = []
    for error, rate in sorted((row[column], row[0]) for row in rows):
        if points and rate >= points[-1][1]:
            continue
        while len(points) > 1 and _is_above(points[-2], points[-1], (error, rate)):
            points.pop()
        points.append((error, rate))
    return points


def interpolate_kbps(rows: Rows, column: int, error: float) -> float:
    """Interpolate the bitrate of a codec at an error in mm log-log on its hull; raise ValueError outside its points."""
    points = lower_hull(rows, column)
    if not points[0][0] <= error <= points[-1][0]:
        raise ValueError(f"the peer was measured from {points[0][0]} to {points[-1][0]} mm, not at {error}")
    errors, rates = np.log(np.array(points)).T
    return math.exp(float(np.interp(math.log(error), errors, rates)))


def mean_curve(clips: list[Rows], column: int, min_error: float, max_error: float) -> list[tuple[float, float]]:
    """Return (error mm, geometric mean of kbit/s over the clips) within the range in which every clip was measured."""
    hulls = [lower_hull(rows, column) for rows in clips]
    low, high = (
        max(min_error, *(points[0][0] for points in hulls)),
        min(max_error, *(points[-1][0] for points in hulls)),
    )
    # rounding must not move the ends outside the range
    errors = np.clip(np.geomspace(low, high, CURVE_SAMPLES), low, high)
    return [
        (float(e), math.exp(np.mean([math.log(interpolate_kbps(rows, column, e)) for rows in clips]))) for e in errors
    ]


def _is_above(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    return (b[1] - a[1]) * (c[0] - a[0]) >= (c[1] - a[1]) * (b[0] - a[0])
