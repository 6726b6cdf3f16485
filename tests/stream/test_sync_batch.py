from __future__ import annotations

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.playout import timeline
from bunraku.wire.messages import Report
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, VirtualTime, motion_with_camera_and_audio


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(9.2, 7.1, 9.2)


@pytest.mark.parametrize("loop", [True, False])
async def test_synced_viewer_gets_same_blocks_as_unsynced_in_each_step(motion: StoredMotion, loop: bool) -> None:
    time = VirtualTime()
    group = FakeViewerGroup(time.context)
    state = timeline.start(motion.id, motion.first_track.duration_us, time.start, loop=loop)
    pairs: list[tuple[SyncedViewer, SyncedViewer]] = []
    batch_counts: list[int] = []
    for step in range(150):
        time.now = time.start + step * 170_000
        # viewers join at different times, some after the motion has looped
        if step in (0, 3, 11, 40, 70):
            pairs.append(
                (
                    SyncedViewer(time.context, motion, state, group),
                    SyncedViewer(time.context, motion, state, None),
                )
            )
        if step == 50:
            state = timeline.edit(state, time.now, position=3_000_000)
        for pair in pairs:
            for each in pair:
                viewer = each.viewer
                viewer.connection.last_received_at = time.now
                if step == 50:
                    viewer.set_timeline(state, motion)
                if step == 20:
                    viewer.on_message(Report(buffer=3_000_000, hidden=True).pack())
                if step == 25:
                    viewer.on_message(Report(buffer=3_000_000, hidden=False).pack())
                if step in (20, 25, 50) or viewer._feed.next_block_at is None:
                    viewer.tick()
                # one tick for each instant at which blocks come within reach
                while viewer._feed.next_block_at is not None and viewer._feed.next_block_at <= time.now:
                    viewer.tick()
        for sync_group in group.sync_groups:
            while sync_group.next_due is not None and sync_group.next_due <= time.now:
                sync_group.tick()
        for synced, unsynced in pairs:
            assert synced.sent_blocks() == unsynced.sent_blocks()
        batch_counts.append(len(group.sync_groups.batches._batches))
    assert max(batch_counts) > 3
    assert max(batch_counts) <= 64


async def test_unwritable_viewer_has_no_tick_for_blocks(motion: StoredMotion) -> None:
    time = VirtualTime()
    state = timeline.start(motion.id, motion.first_track.duration_us, time.start)
    each = SyncedViewer(time.context, motion, state, FakeViewerGroup(time.context))
    each.transport.has_capacity = False
    each.viewer.send_control(b"\x82\x01\x7f")
    time.now = time.start + 3_000_000
    each.viewer.tick()
    assert each.viewer._next_tick() > time.now + 3_000_000
    before = len(each.sent_blocks())
    each.transport.drain()
    assert len(each.sent_blocks()) > before
