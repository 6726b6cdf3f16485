"""Camera and lights of the demo, from key to key on the beats of its score.

World frame, metres, the performer facing z at the origin; the end leads to the start.
"""

from __future__ import annotations

from math import radians
from typing import Any, NamedTuple

import numpy as np

from bunraku.demo.score import Score
from bunraku.motion import easing
from bunraku.motion.easing import EasedMove
from bunraku.motion.rotation import Array

KEYFRAME_RATE_FPS = 30.0


class CameraKey(NamedTuple):
    """Camera view reached at `beat` after a transition of `transition_beats`.

    `azimuth_deg` and `elevation_deg` are angles around the target, towards its left (x) and up; `distance_m` is the
    distance from the target, which is at `target_x`, `target_y` in metres.
    """

    beat: float
    transition_beats: float
    azimuth_deg: float
    elevation_deg: float
    distance_m: float
    target_x: float
    target_y: float


FIELD_OF_VIEW_RAD = radians(26.0)
"""Vertical field of view, the same as the audience's."""
FIRST_CAMERA_KEY = CameraKey(0.0, 0.0, 0.0, 3.0, 7.0, 0.0, 0.92)
CAMERA_KEYS = (
    # the greeting, nearer as the sleeves open
    CameraKey(7.5, 6.5, -6.0, 2.0, 6.4, 0.0, 0.9),
    # with the glides, to the one side and the other
    CameraKey(12.0, 4.0, 14.0, 2.0, 6.3, 0.14, 0.9),
    CameraKey(15.5, 3.25, -12.0, 2.0, 6.3, 0.06, 0.9),
    # the first held pose, from below
    CameraKey(18.1, 2.4, -20.0, -3.0, 6.6, -0.12, 0.92),
    CameraKey(23.5, 3.0, 8.0, 1.0, 6.3, 0.0, 0.94),
    # round a little, against the slow turn
    CameraKey(29.5, 6.0, -34.0, 5.0, 6.4, 0.0, 0.94),
    CameraKey(34.0, 4.5, 0.0, 5.0, 6.6, 0.0, 0.9),
    # the circle, from above
    CameraKey(40.0, 5.5, 20.0, 13.0, 7.4, -0.14, 0.88),
    # the last held pose
    CameraKey(43.1, 3.0, 22.0, -3.0, 6.6, 0.2, 0.92),
    CameraKey(47.75, 3.5, 0.0, 3.0, 7.0, 0.0, 0.92),
)
"""Targets are slightly low: the page has its controls at the bottom."""


class LightKey(NamedTuple):
    """Intensities reached at `beat` after a transition of `transition_beats`; 1 is the stage's default brightness."""

    beat: float
    transition_beats: float
    key: float
    warm_rim: float
    cool_rim: float


LIGHT_POSITIONS = {"key": (-1.9, 3.9, 4.1), "warm": (2.6, 3.0, -2.3), "cool": (-2.9, 1.6, -2.0)}
"""Positions of the lights: in front of the performer, and two behind that outline the figure."""
LIGHT_COLOURS = {"key": (1.0, 0.775, 0.539), "warm": (1.0, 0.694, 0.352), "cool": (0.275, 0.434, 1.0)}
"""Linear RGB."""
FIRST_LIGHT_KEY = LightKey(0.0, 0.0, 0.7, 0.7, 0.7)
LIGHT_KEYS = (
    LightKey(5.5, 4.0, 0.95, 0.9, 0.8),
    # dark before the pose is struck, bright on it
    LightKey(17.6, 1.2, 0.55, 0.8, 0.8),
    LightKey(18.3, 0.5, 1.0, 1.0, 0.7),
    LightKey(21.5, 2.0, 0.95, 0.9, 0.8),
    # the slow turn is the moon's
    LightKey(26.5, 2.5, 0.4, 0.45, 1.0),
    LightKey(32.5, 1.5, 0.95, 0.9, 0.8),
    LightKey(42.5, 1.2, 0.55, 0.8, 0.8),
    LightKey(43.3, 0.5, 1.0, 1.0, 0.7),
    LightKey(47.5, 3.0, 0.7, 0.7, 0.7),
)


def camera_keyframes(score: Score) -> list[dict[str, Any]]:
    """Return the camera for a score, one keyframe per frame, as `POST /v1/motions/{id}/scene` accepts them."""
    time = _keyframe_times(score)
    azimuth, elevation, distance, x, y = _interpolate_keys(score, time, FIRST_CAMERA_KEY, CAMERA_KEYS).T
    azimuth, elevation = np.radians(azimuth), np.radians(elevation)
    gaze = np.stack([x, y, np.zeros_like(x)], axis=1)
    level = distance * np.cos(elevation)
    place = gaze + np.stack([level * np.sin(azimuth), distance * np.sin(elevation), level * np.cos(azimuth)], axis=1)
    return [
        {"time": round(at * 1e6), "position": here.tolist(), "gaze": there.tolist(), "fov": FIELD_OF_VIEW_RAD}
        for at, here, there in zip(time, place, gaze, strict=True)
    ]


def light_keyframes(score: Score) -> list[list[dict[str, Any]]]:
    """Return the key light and the warm and cool rim lights for a score, as `camera_keyframes`."""
    time = _keyframe_times(score)
    return [
        [
            {
                "time": round(at * 1e6),
                "position": LIGHT_POSITIONS[name],
                "colour": LIGHT_COLOURS[name],
                "intensity": intensity,
            }
            for at, intensity in zip(time, intensities.tolist(), strict=True)
        ]
        for name, intensities in zip(
            LIGHT_POSITIONS, _interpolate_keys(score, time, FIRST_LIGHT_KEY, LIGHT_KEYS).T, strict=True
        )
    ]


def _keyframe_times(score: Score) -> Array:
    time: Array = np.arange(round(score.duration * KEYFRAME_RATE_FPS)) / KEYFRAME_RATE_FPS
    return time


def _interpolate_keys(
    score: Score, time: Array, initial: CameraKey | LightKey, keys: tuple[CameraKey | LightKey, ...]
) -> Array:
    """Interpolate the values after beat and transition (n, k) over `time` (n,) seconds."""
    start = now = np.array(initial[2:])
    moves = []
    for key in keys:
        to = np.array(key[2:])
        moves.append(
            EasedMove(
                (key.beat - key.transition_beats) * score.seconds_per_beat,
                key.transition_beats * score.seconds_per_beat,
                to - now,
            )
        )
        now = to
    return easing.superpose(time, start, moves)
