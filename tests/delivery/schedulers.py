"""Schedulers for tests: a motion of twelve seconds, with cameras and lights."""

from __future__ import annotations

from bunraku.codec.motion_track import MotionTrack, plan_motion_track
from bunraku.codec.timing import Timing, plan_timing
from bunraku.delivery.block_scheduler import BlockScheduler, ScheduledTrack
from tests.vectors.blocks import random_motion

TRACK: MotionTrack = plan_motion_track(random_motion(12.0, 30.0, 4))
SECOND_US = 1_000_000
CAMERA = plan_timing(60.0, 720)
"""Camera of the same duration as the motion, in blocks of the same length."""
ONE_MINUTE = plan_timing(30.0, 30 * 60)
"""Motion of one minute."""


def motion_scheduler(level_count: int = 4) -> BlockScheduler:
    return BlockScheduler([ScheduledTrack(0, TRACK, level_count, True)])


def motion_and_scene_scheduler(*timings: Timing, level_count: int = 4) -> BlockScheduler:
    """Return a scheduler of the motion, and of cameras or lights with three levels."""
    scenes = [ScheduledTrack(index, timing, 3, False) for index, timing in enumerate(timings, 1)]
    return BlockScheduler([ScheduledTrack(0, TRACK, level_count, True), *scenes])
