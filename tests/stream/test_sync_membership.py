from __future__ import annotations

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.delivery.block_scheduler import SCHEDULING_MARGIN_US, SendPolicy
from bunraku.playout import timeline
from bunraku.stream.motion_delivery import MotionDelivery
from bunraku.stream.sync_group import MIN_SYNC_US, SEND_SPREAD_US, SyncGroups, SyncMembership
from bunraku.stream.track_selection import TRACK_TYPES
from bunraku.wire.messages import TimelineState
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, VirtualTime, motion_with_camera_and_audio


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(20.3, 17.1, 18.75)


def fully_sent_delivery(motion: StoredMotion, state: TimelineState, now: int) -> tuple[MotionDelivery, int]:
    """Return a delivery that has sent everything within reach, and when the next block is due."""
    delivery = MotionDelivery(motion, TRACK_TYPES, None)
    levels = SendPolicy(delivery.allocation.motion_level, delivery.allocation.audio_level)
    while delivery.scheduler.next_block(state, now, levels) is not None:
        pass
    wait = delivery.scheduler.time_until_next(state, now)
    assert wait is not None
    return delivery, now + wait


async def test_membership_lasts_until_resend_or_change_of_levels(motion: StoredMotion) -> None:
    time = VirtualTime()
    state = timeline.start(motion.id, motion.first_track.duration_us, time.now, loop=True)
    delivery, next_due = fully_sent_delivery(motion, state, time.now)
    viewer, membership = SyncedViewer(time.context, motion, state, None).viewer, SyncMembership(0)
    assert not membership.is_valid(time.now, delivery.allocation)
    assert membership.join(viewer, SyncGroups(time.context), state, delivery, next_due)
    assert membership.group is not None
    assert time.now + MIN_SYNC_US - SEND_SPREAD_US <= membership.expires_at
    assert membership.expires_at < time.now + motion.first_track.duration_us
    assert membership.is_valid(membership.expires_at - 1, delivery.allocation)
    assert not membership.is_valid(membership.expires_at, delivery.allocation)
    higher = delivery.allocation._replace(motion_level=delivery.allocation.motion_level + 1)
    assert not membership.is_valid(time.now, higher)


async def test_blocks_sent_to_group_are_not_sent_again_after_leaving(motion: StoredMotion) -> None:
    time = VirtualTime()
    state = timeline.start(motion.id, motion.first_track.duration_us, time.now, loop=True)
    delivery, next_due = fully_sent_delivery(motion, state, time.now)
    viewer = SyncedViewer(time.context, motion, state, FakeViewerGroup(time.context)).viewer
    membership = SyncMembership(0)
    assert membership.join(viewer, SyncGroups(time.context), state, delivery, next_due)
    group = membership.group
    assert group is not None
    group.tick()
    group.tick()
    due = group.next_due
    assert due is not None
    membership.leave(viewer, delivery)
    assert membership.group is None
    levels = SendPolicy(delivery.allocation.motion_level, delivery.allocation.audio_level)
    assert delivery.scheduler.next_block(state, due - 2 * SCHEDULING_MARGIN_US, levels) is None
    # leaving without a group has no effect
    membership.leave(viewer, delivery)


async def test_viewer_that_holds_next_blocks_does_not_join(motion: StoredMotion) -> None:
    time = VirtualTime()
    state = timeline.start(motion.id, motion.first_track.duration_us, time.now, loop=True)
    delivery, next_due = fully_sent_delivery(motion, state, time.now)
    for index in range(motion.first_track.block_count):
        delivery.scheduler.mark_sent(0, index, delivery.allocation.motion_level)
    viewer, membership = SyncedViewer(time.context, motion, state, None).viewer, SyncMembership(0)
    assert not membership.join(viewer, SyncGroups(time.context), state, delivery, next_due)
    assert membership.group is None
