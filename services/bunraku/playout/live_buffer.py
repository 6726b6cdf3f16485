"""Whole poses of live performers, by the clock times at which they are due (proto/playback.md, 4.10)."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

import numpy as np

from bunraku.codec.live import LiveTrack
from bunraku.motion import rotation
from bunraku.playout.block_store import Pose
from bunraku.wire.live import Live

LIVE_HOLD_US = 500_000
"""Longest gap between messages that is bridged, and time for which the last pose is held: on a constrained link, blocks
of the stored motion delay the first messages by 0.4 s."""
MAX_FRAMES = 256


class LiveBuffer:
    """Last poses of one performer, in order of their due times."""

    def __init__(self, live_track: LiveTrack) -> None:
        self._live_track = live_track
        self._due_times: list[int] = []
        self._poses: list[Pose] = []

    def put(self, due: int, frames: int, block: bytes) -> None:
        """Add the frames of a block, the last due at `due`; one for a time that is held is ignored.

        Raises `DamagedBlock`.
        """
        roots, rotations = self._live_track.decode(frames, block).pose_at(np.arange(frames, dtype=np.float64))
        for nth in range(frames):
            time = due - (frames - 1 - nth) * Live.FRAME_INTERVAL_US
            at = bisect_left(self._due_times, time)
            if at == len(self._due_times) or self._due_times[at] != time:
                self._due_times.insert(at, time)
                self._poses.insert(at, (roots[nth], rotations[nth]))
        excess = max(len(self._due_times) - MAX_FRAMES, 0)
        del self._due_times[:excess], self._poses[:excess]

    def pose_at(self, clock: float) -> Pose | None:
        """Return the pose at `clock`; None before the first one, and after the last one has held."""
        after = bisect_right(self._due_times, clock)
        if after == 0 or clock - self._due_times[after - 1] > LIVE_HOLD_US:
            return None
        before, pose = self._due_times[after - 1], self._poses[after - 1]
        if after == len(self._due_times) or self._due_times[after] - before > LIVE_HOLD_US:
            # after a gap a pose takes effect when it is due
            return pose
        mix = (clock - before) / (self._due_times[after] - before)
        next_root, next_rotations = self._poses[after]
        return (
            pose[0] + mix * (next_root - pose[0]),
            rotation.slerp(pose[1], next_rotations, np.full(len(next_rotations), mix)),
        )
