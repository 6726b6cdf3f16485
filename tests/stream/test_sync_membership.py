"""With whom one viewer is in step, and until when."""

from __future__ import annotations

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.delivery.block_scheduler import SCHEDULING_MARGIN_US
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream.block_batch import BlockBatchCache
from bunraku.stream.motion_delivery import MotionDelivery
from bunraku.stream.sync_group import SyncGroups
from bunraku.stream.sync_membership import MIN_SYNC_US, SEND_SPREAD_US, SyncMembership
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.stream.track_selection import TRACK_TYPES
from bunraku.wire.messages import TimelineState
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, motion_with_camera_and_audio


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(20.3, 17.1, 18.75)


def fully_sent_delivery(motion: StoredMotion, state: TimelineState, now: int) -> tuple[MotionDelivery, int]:
    """One who was sent all that is within reach, and when the next comes."""
    playing = MotionDelivery(motion, TRACK_TYPES, None)
    step = playing.allocation
    while playing.scheduler.next_block(state, now, step.motion_level, step.audio_level) is not None:
        pass
    wait = playing.scheduler.time_until_next(state, now)
    assert wait is not None
    return playing, now + wait


async def test_it_lasts_as_long_as_nothing_comes_that_was_sent_before_and_the_rates_stay(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.first_track.duration_us, now, loop=True)
    playing, following = fully_sent_delivery(motion, state, now)
    member = SyncedViewer(motion, state, None).viewer
    step = SyncMembership(member)
    assert not step.is_valid(now, playing.allocation)
    assert step.join(SyncGroups(BlockBatchCache()), TickScheduler(), state, playing, TRACK_TYPES, following, 0)
    assert step.group is not None
    assert now + MIN_SYNC_US - SEND_SPREAD_US <= step.expires_at < now + motion.first_track.duration_us
    assert step.is_valid(step.expires_at - 1, playing.allocation)
    assert not step.is_valid(step.expires_at, playing.allocation)
    assert not step.is_valid(now, playing.allocation._replace(motion_level=playing.allocation.motion_level + 1))


async def test_what_it_was_sent_there_is_not_sent_again(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.first_track.duration_us, now, loop=True)
    playing, following = fully_sent_delivery(motion, state, now)
    one = SyncedViewer(motion, state, FakeViewerGroup())
    step = SyncMembership(one.viewer)
    assert step.join(SyncGroups(BlockBatchCache()), TickScheduler(), state, playing, TRACK_TYPES, following, 0)
    cohort = step.group
    assert cohort is not None
    cohort.tick()
    cohort.tick()
    at = cohort.next_due
    assert at is not None
    step.leave(playing)
    assert step.group is None
    rates = playing.allocation
    assert (
        playing.scheduler.next_block(state, at - 2 * SCHEDULING_MARGIN_US, rates.motion_level, rates.audio_level)
        is None
    )
    # nobody is in step with nobody
    step.leave(playing)


async def test_who_has_been_sent_what_comes_next_goes_on_alone(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.first_track.duration_us, now, loop=True)
    playing, following = fully_sent_delivery(motion, state, now)
    for index in range(motion.first_track.block_count):
        playing.scheduler.mark_sent(0, index, playing.allocation.motion_level)
    step = SyncMembership(SyncedViewer(motion, state, None).viewer)
    assert not step.join(SyncGroups(BlockBatchCache()), TickScheduler(), state, playing, TRACK_TYPES, following, 0)
    assert step.group is None
