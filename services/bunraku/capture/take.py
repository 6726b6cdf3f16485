"""A take: the poses of a capture, as a motion at a constant frame rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bunraku.capture.session import TimedPose
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, Figure, Motion

MAX_TAKE_POSES = 216_000
"""Most poses of a take: an hour at 60 per second, some 130 MB."""


def make_motion(figure: Figure, poses: Sequence[TimedPose], fps: float) -> Motion:
    """Return the motion of `poses`, from the first to the last, interpolated at `fps` frames per second.

    Raises ValueError without a pose.
    """
    if not poses:
        raise ValueError("a take without a pose is no motion")
    times = np.array([timed.time_s for timed in poses])
    roots = np.stack([timed.pose.root for timed in poses])
    rotations = np.stack([timed.pose.rotations for timed in poses])
    # a frame time that is rounded up to after the last pose still counts
    frames = int((times[-1] - times[0]) * fps + 1e-6) + 1
    at = times[0] + np.arange(frames) / fps
    after = np.clip(np.searchsorted(times, at, side="right"), 1, max(len(times) - 1, 1))
    before = np.minimum(after - 1, len(times) - 1)
    after = np.minimum(after, len(times) - 1)
    share = np.clip((at - times[before]) / np.maximum(times[after] - times[before], 1e-9), 0.0, 1.0)
    root = roots[before] + share[:, None] * (roots[after] - roots[before])
    mixed = rotation.slerp(rotations[before], rotations[after], np.repeat(share[:, None], JOINT_COUNT, axis=1))
    return Motion(figure, fps, root, mixed)
