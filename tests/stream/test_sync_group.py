"""Viewers who have one turn together are sent what each would be sent alone."""

from __future__ import annotations

import random

import pytest

from bunraku.codec.container import StoredMotion
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream import viewer_connection
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import Presence, Report
from tests.stream.sync_viewer import FakeViewerGroup, SyncedViewer, motion_with_camera_and_audio

SECOND = 1_000_000


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return motion_with_camera_and_audio(20.3, 17.1, 18.75)


def turn(one: SyncedViewer, now: int) -> None:
    """Its own turn, where it has one."""
    one.viewer.connection.last_received_at = now
    while (due := one.viewer._next_tick()) <= now and due < now + 8 * SECOND:
        one.viewer.tick()
        if one.viewer._next_tick() <= due:
            return


def turns(audience: FakeViewerGroup, now: int) -> None:
    """The turns of the cohorts that are due."""
    for cohort in audience.sync_groups:
        while cohort.next_due is not None and cohort.next_due + cohort.phase <= now:
            cohort.tick()


@pytest.mark.parametrize("loop", [True, False])
async def test_each_is_sent_what_it_would_be_sent_alone(
    motion: StoredMotion, loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewer_connection, "clock", lambda: now[0])
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    audience = FakeViewerGroup()
    state = timeline.start(motion.id, motion.first_track.duration_us, began, loop=loop)
    pairs: list[tuple[SyncedViewer, SyncedViewer]] = []
    together = 0
    for step in range(500):
        # no step is at an instant at which something comes within reach
        now[0] = began + step * 100_000 + 37_000
        # they come at times of their own, also after the dance has begun again
        if step in (0, 3, 11, 40, 70, 230):
            pairs.append((SyncedViewer(motion, state, audience), SyncedViewer(motion, state, None)))
        if step == 120:
            state = timeline.edit(state, now[0], position=3_000_000)
        for pair in pairs:
            for one in pair:
                one.viewer.connection.last_received_at = now[0]
                if step == 120:
                    one.viewer.set_timeline(state, motion)
                if step in (20, 25):
                    one.viewer.on_message(Report(buffer=3_000_000, hidden=step == 20).pack())
                if step in (20, 25, 120):
                    one.viewer.tick()
                turn(one, now[0])
        turns(audience, now[0])
        together += sum(one.viewer._sync.group is not None for one, _ in pairs)
        for one, alone in pairs:
            assert one.sent_blocks() == alone.sent_blocks()
    assert together > 300


async def test_who_leaves_has_what_it_was_sent_and_a_cohort_ends_with_its_last(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewer_connection, "clock", lambda: now[0])
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    audience = FakeViewerGroup()
    state = timeline.start(motion.id, motion.first_track.duration_us, began)
    one = SyncedViewer(motion, state, audience)
    assert [cohort.phase // 20_000 for cohort in audience.sync_groups] == [one.viewer._phase // 20_000]
    before = one.sent_blocks()
    now[0] = began + 5 * SECOND
    turns(audience, now[0])
    sent = one.sent_blocks()
    assert len(sent) > len(before)
    # no room: it is in step with nobody
    one.transport.has_capacity = False
    one.viewer.send_control(encode_frame(Presence(1, [], [None] * 4).pack()))
    assert not list(audience.sync_groups)
    one.transport.drain()
    assert one.sent_blocks() == sent
    assert [one.viewer._sync.group] == list(audience.sync_groups)
    one.viewer.on_close()
    assert not list(audience.sync_groups)
    assert audience.removed == [one.viewer]


async def test_one_who_comes_between_two_instants_is_sent_the_next_and_not_the_last_again(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewer_connection, "clock", lambda: now[0])
    audience = FakeViewerGroup()
    state = timeline.start(motion.id, motion.first_track.duration_us, began)
    one = SyncedViewer(motion, state, audience)
    (cohort,) = audience.sync_groups
    assert cohort.next_due is not None
    # the next block has come within reach, but the cohort has not had its turn
    now[0] = cohort.next_due + 1_000
    monkeypatch.setattr(random, "randrange", lambda _: one.viewer._phase)
    two = SyncedViewer(motion, state, audience)
    assert [one.viewer._sync.group, two.viewer._sync.group] == [cohort, cohort]
    for _ in range(3):
        cohort.tick()
    assert len(two.sent_blocks()) == len(set(two.sent_blocks()))
    latest = max(one.sent_blocks())
    assert latest in two.sent_blocks()
