"""Viewers in step are sent what each would be sent alone."""

from __future__ import annotations

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream import viewer_connection
from bunraku.wire.messages import Report
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, motion_with_camera_and_audio


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(9.2, 7.1, 9.2)


@pytest.mark.parametrize("loop", [True, False])
async def test_each_is_sent_what_it_would_be_sent_alone(
    motion: StoredMotion, loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewer_connection, "clock", lambda: now[0])
    audience = FakeViewerGroup()
    state = timeline.start(motion.id, motion.first_track.duration_us, began, loop=loop)
    pairs: list[tuple[SyncedViewer, SyncedViewer]] = []
    made: list[int] = []
    for step in range(150):
        now[0] = began + step * 170_000
        # they come at times of their own, also after the dance has begun again
        if step in (0, 3, 11, 40, 70):
            pairs.append((SyncedViewer(motion, state, audience), SyncedViewer(motion, state, None)))
        if step == 50:
            state = timeline.edit(state, now[0], position=3_000_000)
        for together, alone in pairs:
            for one in (together, alone):
                one.viewer.connection.last_received_at = now[0]
                if step == 50:
                    one.viewer.set_timeline(state, motion)
                if step == 20:
                    one.viewer.on_message(Report(buffer=3_000_000, hidden=True).pack())
                if step == 25:
                    one.viewer.on_message(Report(buffer=3_000_000, hidden=False).pack())
                if step in (20, 25, 50) or one.viewer._next_block_at is None:
                    one.viewer.tick()
                # a turn for each instant at which something comes
                while one.viewer._next_block_at is not None and one.viewer._next_block_at <= now[0]:
                    one.viewer.tick()
        for cohort in audience.sync_groups:
            while cohort.next_due is not None and cohort.next_due <= now[0]:
                cohort.tick()
        for together, alone in pairs:
            assert together.sent_blocks() == alone.sent_blocks()
        made.append(len(audience.batches._batches))
    assert max(made) > 3
    assert max(made) <= 64


async def test_one_without_room_is_not_asked_again_and_again(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewer_connection, "clock", lambda: now[0])
    state = timeline.start(motion.id, motion.first_track.duration_us, began)
    one = SyncedViewer(motion, state, FakeViewerGroup())
    one.transport.has_capacity = False
    one.viewer.send_control(b"\x82\x01\x7f")
    now[0] = began + 3_000_000
    one.viewer.tick()
    assert one.viewer._next_tick() > now[0] + 3_000_000
    before = len(one.sent_blocks())
    one.transport.drain()
    assert len(one.sent_blocks()) > before
