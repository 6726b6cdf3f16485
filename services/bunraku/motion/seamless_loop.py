"""Seamless repetition of a part of a motion.

The last frames of the part are blended into the frames before its start, so that they lead to its first frame with the
velocity that it has there. Frames before the first of the motion are extrapolated from it: they approach it with its
velocity, which fades in going back.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion

BLEND_S = 0.5
"""Longest blend at the end of a repetition, in seconds; at most half of the part is blended."""
EXTRAPOLATION_S = 0.1
"""Time in which the velocity of extrapolated frames fades, in seconds."""
MAX_DRIFT_M = 0.3
"""Horizontal distance between both ends of a part up to which it dances on the spot: the blend leads back to the first
place. Beyond it the part travels, and its travel is kept."""


def close_loop(motion: Motion, first: int, end: int) -> Motion:
    """Return frames `first` to `end` - 1 of a motion, whose repetition has no jump in pose or velocity.

    A part that ends farther than `MAX_DRIFT_M` from where it began keeps its horizontal travel: its last frames blend
    into the earlier ones moved by that travel, and each repetition begins at the first place again.
    """
    count = end - first
    blended = min(round(BLEND_S * motion.fps), count // 2)
    root, rotations = motion.root[first:end].copy(), motion.rotations[first:end].copy()
    if blended == 0:
        return Motion(motion.figure, motion.fps, root, rotations)
    travel = _frame_after(motion.root, end) - motion.root[first]
    travel[1] = 0.0
    if np.hypot(travel[0], travel[2]) <= MAX_DRIFT_M:
        travel[:] = 0.0
    before_root, before_rotations = _frames_before(motion, first, blended)
    share = minimum_jerk(np.arange(blended) / blended)
    tail = slice(count - blended, count)
    root[tail] += share[:, None] * (before_root + travel - root[tail])
    turn = rotation.multiply(rotation.conjugate(rotations[tail]), before_rotations)
    # one way round for the whole blend, the shorter one at its end
    vectors = rotation.unwrap_rotation_vectors(rotation.to_rotation_vector(turn)[::-1])[::-1]
    rotations[tail] = rotation.multiply(rotations[tail], rotation.from_rotation_vector(share[:, None, None] * vectors))
    return Motion(motion.figure, motion.fps, root, rotations)


def close_value_loop(values: Array, first: int, end: int, fps: float) -> Array:
    """Return frames `first` to `end` - 1 of values (n, ...), blended as by `close_loop`; before frame 0 they stay."""
    part: Array = values[first:end].copy()
    blended = min(round(BLEND_S * fps), len(part) // 2)
    if blended > 0:
        before = values[np.maximum(np.arange(first - blended, first), 0)]
        share = minimum_jerk(np.arange(blended) / blended).reshape(-1, *[1] * (values.ndim - 1))
        part[-blended:] += share * (before - part[-blended:])
    return part


def _frame_after(positions: Array, end: int) -> Array:
    """Return the position at frame `end`, extrapolated if it is beyond the last frame."""
    if end < len(positions):
        following: Array = positions[end].copy()
        return following
    after: Array = 2.0 * positions[-1] - positions[max(len(positions) - 2, 0)]
    return after


def _frames_before(motion: Motion, first: int, count: int) -> tuple[Array, Array]:
    """Return root and rotations of the `count` frames before `first`."""
    recorded = slice(max(first - count, 0), first)
    root, rotations = motion.root[recorded], motion.rotations[recorded]
    missing = count - len(root)
    if missing == 0:
        return root, rotations
    following = min(1, motion.frame_count - 1)
    fade_frames = EXTRAPOLATION_S * motion.fps
    # signed distance from frame 0 in frames, at the velocity of frame 0
    distance = -fade_frames * (1.0 - np.exp(-np.arange(missing, 0, -1) / fade_frames))
    step = rotation.to_rotation_vector(
        rotation.multiply(rotation.conjugate(motion.rotations[0]), motion.rotations[following])
    )
    turns = rotation.from_rotation_vector(distance[:, None, None] * step)
    earlier_root = motion.root[0] + distance[:, None] * (motion.root[following] - motion.root[0])
    earlier_rotations = rotation.multiply(np.broadcast_to(motion.rotations[0], turns.shape), turns)
    return np.concatenate([earlier_root, root]), np.concatenate([earlier_rotations, rotations])
