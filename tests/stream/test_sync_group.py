from __future__ import annotations

import random

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.playout import timeline
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import Presence, Report
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, VirtualTime, motion_with_camera_and_audio

SECOND_US = 1_000_000


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(20.3, 17.1, 18.75)


def run_viewer_ticks(each: SyncedViewer, now: int) -> None:
    """Run the ticks of a viewer that are due."""
    each.viewer.connection.last_received_at = now
    while (due := each.viewer._next_tick()) <= now and due < now + 8 * SECOND_US:
        each.viewer.tick()
        if each.viewer._next_tick() <= due:
            return


def run_group_ticks(group: FakeViewerGroup, now: int) -> None:
    """Run the ticks of the synchronised groups that are due."""
    for sync_group in group.sync_groups:
        while sync_group.next_due is not None and sync_group.next_due + sync_group.phase <= now:
            sync_group.tick()


@pytest.mark.parametrize("loop", [True, False])
async def test_synced_viewer_gets_same_blocks_as_unsynced(
    motion: StoredMotion, loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = VirtualTime()
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    group = FakeViewerGroup(time.context)
    state = timeline.start(motion.id, motion.first_track.duration_us, time.start, loop=loop)
    pairs: list[tuple[SyncedViewer, SyncedViewer]] = []
    synced_steps = 0
    for step in range(500):
        # no step falls on an instant at which blocks come within reach
        time.now = time.start + step * 100_000 + 37_000
        # viewers join at different times, some after the motion has looped
        if step in (0, 3, 11, 40, 70, 230):
            pairs.append(
                (
                    SyncedViewer(time.context, motion, state, group),
                    SyncedViewer(time.context, motion, state, None),
                )
            )
        if step == 120:
            state = timeline.edit(state, time.now, position=3_000_000)
        for pair in pairs:
            for each in pair:
                each.viewer.connection.last_received_at = time.now
                if step == 120:
                    each.viewer.set_timeline(state, motion)
                if step in (20, 25):
                    each.viewer.on_message(Report(buffer=3_000_000, hidden=step == 20).pack())
                if step in (20, 25, 120):
                    each.viewer.tick()
                run_viewer_ticks(each, time.now)
        run_group_ticks(group, time.now)
        synced_steps += sum(synced.viewer._sync.group is not None for synced, _ in pairs)
        for synced, unsynced in pairs:
            assert synced.sent_blocks() == unsynced.sent_blocks()
    assert synced_steps > 300


async def test_leaving_marks_blocks_as_sent_and_ends_empty_group(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = VirtualTime()
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    group = FakeViewerGroup(time.context)
    state = timeline.start(motion.id, motion.first_track.duration_us, time.start)
    each = SyncedViewer(time.context, motion, state, group)
    phase = each.viewer._sync.phase
    assert [sync_group.phase // 20_000 for sync_group in group.sync_groups] == [phase // 20_000]
    before = each.sent_blocks()
    time.now = time.start + 5 * SECOND_US
    run_group_ticks(group, time.now)
    sent = each.sent_blocks()
    assert len(sent) > len(before)
    # an unwritable connection leaves its group
    each.transport.has_capacity = False
    each.viewer.send_control(encode_frame(Presence(1, [], [None] * 4).pack()))
    assert not list(group.sync_groups)
    each.transport.drain()
    assert each.sent_blocks() == sent
    assert [each.viewer._sync.group] == list(group.sync_groups)
    each.viewer.on_close()
    assert not list(group.sync_groups)
    assert group.removed == [each.viewer]


async def test_joining_between_two_batches_repeats_no_block(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = VirtualTime()
    group = FakeViewerGroup(time.context)
    state = timeline.start(motion.id, motion.first_track.duration_us, time.start)
    first = SyncedViewer(time.context, motion, state, group)
    (sync_group,) = group.sync_groups
    assert sync_group.next_due is not None
    # the next block has come within reach, but the group's tick is still to come
    time.now = sync_group.next_due + 1_000
    monkeypatch.setattr(random, "randrange", lambda _: first.viewer._sync.phase)
    second = SyncedViewer(time.context, motion, state, group)
    assert [first.viewer._sync.group, second.viewer._sync.group] == [sync_group, sync_group]
    for _ in range(3):
        sync_group.tick()
    assert len(second.sent_blocks()) == len(set(second.sent_blocks()))
    latest = max(first.sent_blocks())
    assert latest in second.sent_blocks()
