"""One live capture: datagrams in, poses of the calibrated figure out, on the local clock."""

from __future__ import annotations

from typing import NamedTuple

from bunraku.capture.calibration import MAX_CALIBRATION_FRAMES, Calibration, calibrate
from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import CapturedFrame, FrameAssembler
from bunraku.capture.reorder import ReorderBuffer, ReorderStatistics, TimedFrame
from bunraku.capture.retarget import Pose, Retargeter

CALIBRATION_S = 1.0
"""Time over which frames are collected for a calibration."""


class TimedPose(NamedTuple):
    """Pose with its sample time on the local clock, seconds. Times increase strictly."""

    time_s: float
    pose: Pose


class CaptureSession:
    """Capture of one performer. Times are arguments, in seconds of one local clock.

    The first frames calibrate; poses come after that. The performer should stand upright meanwhile and may move.
    """

    def __init__(self, assembler: FrameAssembler, calibration_s: float = CALIBRATION_S) -> None:
        self.calibration: Calibration | None = None
        self._assembler = assembler
        self._calibration_s = calibration_s
        self._buffer = ReorderBuffer()
        self._retargeter: Retargeter | None = None
        self._collected: list[CapturedFrame] | None = []
        self._calibration_start_s: float | None = None

    @property
    def is_calibrating(self) -> bool:
        """True while frames are collected for a calibration."""
        return self._collected is not None

    @property
    def statistics(self) -> ReorderStatistics:
        """Counts of frames released and dropped."""
        return self._buffer.statistics

    @property
    def deadline_s(self) -> float | None:
        """Time at which `poll` should be called if no datagram arrives before; None if nothing waits."""
        return self._buffer.deadline_s

    def recalibrate(self) -> None:
        """Begin a new calibration. Poses of the current one continue until it is complete."""
        self._collected = []
        self._calibration_start_s = None

    def receive(self, datagram: bytes, arrival_s: float) -> list[TimedPose]:
        """Return the poses that `datagram` completes, oldest first.

        Raises `UnreadableCapture` if the datagram is invalid, which changes nothing, or if the collected frames are not
        those of a body; then the calibration begins again.
        """
        released: list[TimedFrame] = []
        for frame in self._assembler.feed(datagram):
            released += self._buffer.push(frame, arrival_s)
        return self._retarget(released)

    def poll(self, now_s: float) -> list[TimedPose]:
        """Return the poses that waited for a missing one until `now_s`; raise `UnreadableCapture` as `receive` does."""
        return self._retarget(self._buffer.poll(now_s))

    def _retarget(self, released: list[TimedFrame]) -> list[TimedPose]:
        poses = []
        for time_s, frame in ((timed.time_s, timed.frame) for timed in released):
            if self._collected is not None:
                self._collect(time_s, frame, self._collected)
            if self._retargeter is not None:
                poses.append(TimedPose(time_s, self._retargeter.retarget(frame)))
        return poses

    def _collect(self, time_s: float, frame: CapturedFrame, collected: list[CapturedFrame]) -> None:
        """Add a frame to the calibration, and calibrate once its time is over."""
        if self._calibration_start_s is None:
            self._calibration_start_s = time_s
        if len(collected) < MAX_CALIBRATION_FRAMES:
            collected.append(frame)
        if time_s - self._calibration_start_s < self._calibration_s:
            return
        try:
            self.calibration = calibrate(self._assembler.skeleton, collected)
        except UnreadableCapture:
            self.recalibrate()
            raise
        self._retargeter = Retargeter(self.calibration)
        self._collected = None
