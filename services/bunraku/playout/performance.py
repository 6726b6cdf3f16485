"""Pose of a live performer at any capture time, from samples that arrive late, twice, in any order, or not at all.

Between two samples the pose is interpolated. A performer who falls silent stands still for `HOLD_US`, then goes to the
rest pose within `FADE_US`; when samples arrive again, the pose returns to them within `MAX_RETURN_US`, so that
nothing jumps. Pure: times are arguments, microseconds on the reference clock.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from enum import Enum

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.skeleton import JOINT_COUNT, Figure
from bunraku.playout.block_store import Pose
from bunraku.playout.delay import PlayoutDelay
from bunraku.playout.overlay_buffer import RADIANS_PER_UNIT
from bunraku.wire.live import Sample

ON_TIME_QUANTILE = 0.99
"""Share of the samples that must arrive before the poses that need them: a few in a hundred are lost on the way."""
MAX_GAP_US = 250_000
"""Longest time between two samples that is interpolated."""
HOLD_US = 500_000
FADE_US = 1_000_000
MAX_RETURN_US = 300_000
RETURN_RATIO = 4
"""Time of the return as a multiple of the silence: a single late sample is caught up with at once."""
MAX_AGE_US = 1_000_000
"""Samples older than this are ignored."""
MAX_AHEAD_US = 200_000
"""Samples from further in the future are ignored: the performer's clock is not synchronised."""
MAX_SAMPLES = 512
MARGIN_US = 4_000
"""Added to that quantile: a later sample is replaced by the pose before it, for one frame."""
INITIAL_LATENESS_US = 8_000
"""Assumed lateness of samples until enough have arrived to know it."""


class SampleOutcome(Enum):
    """What became of a sample."""

    APPLIED = "applied"
    DUPLICATE = "duplicate"
    LATE = "late"
    AHEAD = "ahead"


class Performance:
    """Samples of one live performer, and the pose that they give."""

    def __init__(self, figure: Figure, fps: float, *, starts_at_rest: bool = True) -> None:
        """Expect about `fps` samples per second.

        Until the first one the figure is in its rest pose at the origin, from which it goes to the pose of the samples;
        unless it `starts_at_rest`, the first pose is that of the first sample.
        """
        self._times: list[int] = []
        self._samples: list[Pose] = []
        self._delay = PlayoutDelay(1e6 / fps + INITIAL_LATENESS_US, ON_TIME_QUANTILE, MARGIN_US)
        self._rest_height = float(figure.offsets[0, 1])
        self._rest_rotations = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
        self._shown: Pose = np.array([0.0, self._rest_height, 0.0]), self._rest_rotations
        self._is_silent = starts_at_rest
        self._silent_since = -(HOLD_US + FADE_US)
        self._transition_from = self._shown
        self._returning_since: int | None = None
        self._return_us = MAX_RETURN_US

    @property
    def newest_us(self) -> int | None:
        """Capture time of the newest sample, None before the first one."""
        return self._times[-1] if self._times else None

    def delay_us(self, now: int) -> int:
        """Return the delay with which poses are shown behind the clock, so that nearly all samples arrive in time."""
        return round(self._delay.at(now))

    def add(self, sampled: int, pose: Pose, now: int) -> SampleOutcome:
        """Add the pose of capture time `sampled`: root (3,) in metres and unit quaternions (18, 4)."""
        if sampled > now + MAX_AHEAD_US:
            return SampleOutcome.AHEAD
        if sampled < now - MAX_AGE_US:
            return SampleOutcome.LATE
        at = bisect_left(self._times, sampled)
        if at < len(self._times) and self._times[at] == sampled:
            return SampleOutcome.DUPLICATE
        if at > 0 and sampled - self._times[at - 1] <= MAX_GAP_US:
            # a pose between two samples needs the later one
            self._delay.add_lateness(now - self._times[at - 1], now)
        self._times.insert(at, sampled)
        self._samples.insert(at, pose)
        if len(self._times) > MAX_SAMPLES:
            del self._times[0], self._samples[0]
        return SampleOutcome.APPLIED

    def pose_at(self, capture: int) -> Pose:
        """Return the pose at capture time `capture`, which must not decrease from call to call."""
        after = bisect_right(self._times, capture)
        is_covered = self._is_covered(after, capture)
        self._shown = self._sampled_pose(after, capture) if is_covered else self._rest(after, capture)
        # one sample before the next capture time is needed
        expired = max(after - 1, 0)
        del self._times[:expired], self._samples[:expired]
        return self._shown

    def is_at_rest(self, capture: int) -> bool:
        """Return whether the performer has fallen silent and reached the rest pose."""
        return self._is_silent and capture - self._silent_since >= HOLD_US + FADE_US

    def _is_covered(self, after: int, capture: int) -> bool:
        if after == 0:
            return False
        before = self._times[after - 1]
        return before == capture or (after < len(self._times) and self._times[after] - before <= MAX_GAP_US)

    def _sampled_pose(self, after: int, capture: int) -> Pose:
        if self._is_silent:
            self._is_silent = False
            self._transition_from, self._returning_since = self._shown, capture
            self._return_us = min(max(RETURN_RATIO * (capture - self._silent_since), 1), MAX_RETURN_US)
        begin, pose = self._times[after - 1], self._samples[after - 1]
        if begin < capture:
            pose = _blend(pose, self._samples[after], (capture - begin) / (self._times[after] - begin))
        if self._returning_since is None:
            return pose
        share = (capture - self._returning_since) / self._return_us
        if share >= 1.0:
            self._returning_since = None
            return pose
        return _blend(self._transition_from, pose, _ease(share))

    def _rest(self, after: int, capture: int) -> Pose:
        if not self._is_silent:
            self._is_silent = True
            self._silent_since = capture
            # the last sample, unless the pose was still on its way to it
            self._transition_from = self._shown if self._returning_since is not None else self._samples[after - 1]
        root, rotations = self._transition_from
        share = (capture - self._silent_since - HOLD_US) / FADE_US
        if share <= 0.0:
            return root, rotations
        rest = np.array([root[0], self._rest_height, root[2]]), self._rest_rotations
        return _blend((root, rotations), rest, _ease(share))


def _ease(share: float) -> float:
    return float(minimum_jerk(np.array(share)))


def _blend(start: Pose, end: Pose, share: float) -> Pose:
    return (
        start[0] + share * (end[0] - start[0]),
        rotation.slerp(start[1], end[1], np.full(JOINT_COUNT, share)),
    )


def pack_sample(sampled: int, pose: Pose, sequence: int = 0) -> Sample:
    """Return the sample of a pose that was captured at clock time `sampled`.

    The pose is the root (3,) in metres and unit quaternions (18, 4).
    """
    root, rotations = pose
    units = np.round(rotation.to_rotation_vector(rotations) / RADIANS_PER_UNIT).astype(int)
    x, y, z = np.asarray(root, dtype=np.float32).tolist()
    return Sample(sequence, sampled, (x, y, z), tuple(units.ravel().tolist()))


def sample_pose(sample: Sample) -> Pose:
    """Return the pose of a sample."""
    vectors = np.reshape(sample.rotations, (JOINT_COUNT, 3)) * RADIANS_PER_UNIT
    return np.array(sample.root), rotation.from_rotation_vector(vectors)
