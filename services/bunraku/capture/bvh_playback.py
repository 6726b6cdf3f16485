"""Playback of a BVH file in real time, in place of a live capture."""

from __future__ import annotations

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.retarget import Pose
from bunraku.capture.session import TimedPose
from bunraku.motion.analysis import analyse
from bunraku.motion.bvh import parse_bvh
from bunraku.motion.errors import UnreadableMotion

MAX_LAG_S = 1.0
"""Lag of the caller beyond which frames are skipped."""


class BvhPlayback:
    """Frames of a file at its frame rate. The whole file is analysed, so nothing needs calibration.

    Raises `UnreadableCapture` if `data` is not a BVH file of a humanoid. `start_s` is the time of the first frame on
    the caller's clock.
    """

    def __init__(self, data: bytes, start_s: float, *, loop: bool = False) -> None:
        try:
            analysis = analyse(parse_bvh(data))
        except UnreadableMotion as error:
            raise UnreadableCapture(
                error.title, error.detail, field=error.field, line=error.line, hint=error.hint
            ) from error
        self.figure = analysis.motion.figure
        self.assumptions = analysis.assumptions
        self._motion = analysis.motion
        self._start_s = start_s
        self._loop = loop
        self._next = 0

    @property
    def deadline_s(self) -> float | None:
        """Time of the next frame; None after the last one."""
        if not self._loop and self._next >= self._motion.frame_count:
            return None
        return self._start_s + self._next / self._motion.fps

    def poll(self, now_s: float) -> list[TimedPose]:
        """Return the frames due at `now_s`. Frames overdue by more than `MAX_LAG_S` are skipped."""
        skipped = int((now_s - self._start_s - MAX_LAG_S) * self._motion.fps)
        self._next = max(self._next, skipped if self._loop else min(skipped, self._motion.frame_count))
        poses = []
        while (deadline_s := self.deadline_s) is not None and deadline_s <= now_s:
            frame = self._next % self._motion.frame_count
            poses.append(TimedPose(deadline_s, Pose(self._motion.root[frame], self._motion.rotations[frame], {})))
            self._next += 1
        return poses
