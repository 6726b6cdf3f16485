"""Foot contacts: the frames of a motion in which each foot rests on the floor.

A foot is planted while its ball rests: the joint `midtarsal`, about which the heel rises before a step. A contact
begins where the ball is low and slow, and ends where it is high, fast, or away from where it was put. Begin and end
have thresholds of their own, so that noise does not make contacts flicker. Heights are above the floor of the clip.
Lengths are metres of the standard figure; those of another figure are scaled by its legs.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure, Motion, standard_figure, world_transforms

BoolArray = npt.NDArray[np.bool_]

FEET = ("l", "r")
"""Prefixes of the joints of each foot, in the order of contacts."""
BEGIN_HEIGHT_M, END_HEIGHT_M = 0.05, 0.08
"""Heights of the ball above the floor below which a contact begins, and above which it ends."""
BEGIN_SPEED, END_SPEED = 0.2, 0.4
"""Speeds of the ball, metres per second, below which a contact begins, and above which it ends."""
MAX_DRIFT_M = 0.04
"""Distance of the ball over the floor from where it was put beyond which a contact ends: the foot slides."""
MIN_CONTACT_S = 0.1
"""Shorter contacts are left out."""
MIN_GAP_S = 0.15
"""Shortest time between two contacts of a foot: in less, no foot is lifted and put down."""
_SPEED_WINDOW_S = 0.08
"""Time over which a speed is measured: longer than the noise of a capture, shorter than a step."""
_FLOOR_SHARE = 0.1
"""Share of the frames in which the lower ball is below the floor or on it."""


def detect_contacts(motion: Motion) -> BoolArray:
    """Return whether the left and the right foot are planted in each frame (n, 2)."""
    scale = _leg_length(motion.figure) / _leg_length(standard_figure())
    placed, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    balls = placed[:, [JOINT_INDEX[f"{side}_midtarsal"] for side in FEET]] / scale
    balls[..., 1] -= np.quantile(balls[..., 1].min(axis=1), _FLOOR_SHARE)
    return np.stack([_detect_foot(balls[:, foot], motion.fps) for foot in range(len(FEET))], axis=1)


def _detect_foot(ball: Array, fps: float) -> BoolArray:
    """Return whether a foot is planted in each frame (n,), by the positions (n, 3) of its ball above the floor."""
    height, speed = ball[:, 1], _measure_speed(ball, fps)
    may_begin = ((height < BEGIN_HEIGHT_M) & (speed < BEGIN_SPEED)).tolist()
    must_end = ((height > END_HEIGHT_M) | (speed > END_SPEED)).tolist()
    min_frames, gap_frames = max(round(MIN_CONTACT_S * fps), 1), max(round(MIN_GAP_S * fps), 1)
    planted = np.zeros(len(ball), dtype=np.bool_)
    places = [*ball[:, [0, 2]].tolist(), None]
    begin, earliest = -1, 0
    for frame, place in enumerate(places):
        if begin < 0:
            if place is not None and may_begin[frame] and frame >= earliest:
                begin = frame
        elif place is None or must_end[frame] or math.dist(place, places[begin]) > MAX_DRIFT_M:
            if frame - begin >= min_frames:
                planted[begin:frame] = True
                earliest = frame + gap_frames
            begin = -1
    return planted


def _measure_speed(ball: Array, fps: float) -> Array:
    """Return the mean speed (n,) around each frame, metres per second."""
    reach = max(round(_SPEED_WINDOW_S * fps / 2), 1)
    frames = np.arange(len(ball))
    before, after = np.maximum(frames - reach, 0), np.minimum(frames + reach, len(ball) - 1)
    speed: Array = np.linalg.norm(ball[after] - ball[before], axis=1) * fps / np.maximum(after - before, 1)
    return speed


def _leg_length(figure: Figure) -> float:
    """Return the length of thigh and shank, metres, at least a millimetre."""
    knee, ankle = figure.offsets[JOINT_INDEX["l_knee"]], figure.offsets[JOINT_INDEX["l_ankle"]]
    return max(float(np.linalg.norm(knee) + np.linalg.norm(ankle)), 1e-3)
