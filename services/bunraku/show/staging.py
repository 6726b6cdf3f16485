"""Camera and lights for the demo's dance, from key to key on the beats of its score.

World frame, metres, the dancer facing z at the origin; the end leads on to the beginning.
"""

from __future__ import annotations

from math import radians
from typing import Any, NamedTuple

import numpy as np

from bunraku.motion import easing
from bunraku.motion.easing import Move
from bunraku.motion.rotation import Array
from bunraku.motion.score import Score

FPS = 30.0


class Shot(NamedTuple):
    """The camera comes to a view at `beat`, having set out `over` beats earlier: `aside` and `above`, degrees round
    what it looks at, to its left (x) and up; metres `away` from there; and there, `x` and `y`, metres."""

    beat: float
    over: float
    aside: float
    above: float
    away: float
    x: float
    y: float


FIELD = radians(26.0)
"""Vertical field of view, the same as the audience's own."""
OPENING = Shot(0.0, 0.0, 0.0, 3.0, 7.0, 0.0, 0.92)
SHOTS = (
    # the greeting, nearer as the sleeves open
    Shot(7.5, 6.5, -6.0, 2.0, 6.4, 0.0, 0.9),
    # with the glides, to the one side and the other
    Shot(12.0, 4.0, 14.0, 2.0, 6.3, 0.14, 0.9),
    Shot(15.5, 3.25, -12.0, 2.0, 6.3, 0.06, 0.9),
    # the first held pose, from below
    Shot(18.1, 2.4, -20.0, -3.0, 6.6, -0.12, 0.92),
    Shot(23.5, 3.0, 8.0, 1.0, 6.3, 0.0, 0.94),
    # round a little, against the slow turn
    Shot(29.5, 6.0, -34.0, 5.0, 6.4, 0.0, 0.94),
    Shot(34.0, 4.5, 0.0, 5.0, 6.6, 0.0, 0.9),
    # the circle, from above
    Shot(40.0, 5.5, 20.0, 13.0, 7.4, -0.14, 0.88),
    # the last held pose
    Shot(43.1, 3.0, 22.0, -3.0, 6.6, 0.2, 0.92),
    Shot(47.75, 3.5, 0.0, 3.0, 7.0, 0.0, 0.92),
)
"""They look a little low: below, a page has its controls."""


class Cue(NamedTuple):
    """The lights come to these intensities at `beat`, having set out `over` beats earlier; 1 is full, as bright as the
    stage has them without a show."""

    beat: float
    over: float
    key: float
    warm: float
    cool: float


PLACES = {"key": (-1.9, 3.9, 4.1), "warm": (2.6, 3.0, -2.3), "cool": (-2.9, 1.6, -2.0)}
"""Where the lights hang: before the dancer, and two behind that draw the outline."""
COLOURS = {"key": (1.0, 0.775, 0.539), "warm": (1.0, 0.694, 0.352), "cool": (0.275, 0.434, 1.0)}
"""Linear RGB."""
FIRST = Cue(0.0, 0.0, 0.7, 0.7, 0.7)
CUES = (
    Cue(5.5, 4.0, 0.95, 0.9, 0.8),
    # dark before the pose is struck, bright on it
    Cue(17.6, 1.2, 0.55, 0.8, 0.8),
    Cue(18.3, 0.5, 1.0, 1.0, 0.7),
    Cue(21.5, 2.0, 0.95, 0.9, 0.8),
    # the slow turn is the moon's
    Cue(26.5, 2.5, 0.4, 0.45, 1.0),
    Cue(32.5, 1.5, 0.95, 0.9, 0.8),
    Cue(42.5, 1.2, 0.55, 0.8, 0.8),
    Cue(43.3, 0.5, 1.0, 1.0, 0.7),
    Cue(47.5, 3.0, 0.7, 0.7, 0.7),
)


def camera(score: Score) -> list[dict[str, Any]]:
    """The show's camera for a dance of this score, a keyframe a frame, as `POST /v1/motions/{id}/scene` takes them."""
    time = _time(score)
    aside, above, away, x, y = _track(score, time, OPENING, SHOTS).T
    aside, above = np.radians(aside), np.radians(above)
    gaze = np.stack([x, y, np.zeros_like(x)], axis=1)
    level = away * np.cos(above)
    place = gaze + np.stack([level * np.sin(aside), away * np.sin(above), level * np.cos(aside)], axis=1)
    return [
        {"time": round(at * 1e6), "position": here.tolist(), "gaze": there.tolist(), "fov": FIELD}
        for at, here, there in zip(time, place, gaze, strict=True)
    ]


def lights(score: Score) -> list[list[dict[str, Any]]]:
    """The key light, the warm and the cool one behind, for a dance of this score; as `camera`."""
    time = _time(score)
    return [
        [
            {"time": round(at * 1e6), "position": PLACES[name], "colour": COLOURS[name], "intensity": intensity}
            for at, intensity in zip(time, intensities.tolist(), strict=True)
        ]
        for name, intensities in zip(PLACES, _track(score, time, FIRST, CUES).T, strict=True)
    ]


def _time(score: Score) -> Array:
    time: Array = np.arange(round(score.duration * FPS)) / FPS
    return time


def _track(score: Score, time: Array, first: Shot | Cue, keys: tuple[Shot | Cue, ...]) -> Array:
    """The numbers after `beat` and `over` (n, k) over `time` (n,), seconds."""
    start = now = np.array(first[2:])
    moves = []
    for key in keys:
        to = np.array(key[2:])
        moves.append(Move((key.beat - key.over) * score.seconds_per_beat, key.over * score.seconds_per_beat, to - now))
        now = to
    return easing.superpose(time, start, moves)
