from __future__ import annotations

import msgpack
import pytest

from bunraku.backing.bus import MemoryBus, NobodyAnswers
from bunraku.backing.library import Library
from bunraku.playout import timeline
from bunraku.stream.sessions import WatchedSessions
from bunraku.stream.viewers import Viewer
from bunraku.wire.messages import Overlay, Presence

STATE = timeline.start("m", 5_000_000, 1_000)
PRESENCE = Presence(0, [], [None] * 4)


def stage(bus: MemoryBus) -> list[list[object]]:
    """A session on the bus; what it hears of viewers."""

    async def state(_: bytes) -> bytes:
        packed: bytes = msgpack.packb([STATE.pack(), PRESENCE.pack(), Overlay(1, 5, {}).pack()])
        return packed

    heard: list[list[object]] = []
    bus.answer("session.s.state", state)
    bus.subscribe("session.s.viewers", lambda message: heard.append(msgpack.unpackb(message)))
    return heard


async def test_one_subscription_serves_all_viewers_and_ends_with_the_last() -> None:
    bus = MemoryBus()
    heard = stage(bus)
    watched = WatchedSessions(bus)
    viewers = [Viewer(Library.open("memory:///"), None) for _ in range(3)]
    for viewer in viewers:
        await watched.join("s", viewer)
    assert len(bus._handlers["session.s.overlay"]) == 1
    pulled = Overlay(2, 6, {1: (0,) * 9}).pack()
    bus.publish("session.s.overlay", pulled)
    viewers.append(Viewer(Library.open("memory:///"), None))
    await watched.join("s", viewers[-1])
    bus.publish("session.s.timeline", timeline.edit(STATE, 2_000, playing=False).pack())
    assert all(viewer._overlay == pulled for viewer in viewers)
    assert all(viewer._timelines.newest == timeline.edit(STATE, 2_000, playing=False) for viewer in viewers)
    for viewer in viewers:
        watched.leave("s", viewer)
    watched.leave("s", viewers[0])
    assert [count for _, count in heard] == [1, 2, 3, 4, 3, 2, 1, 0]
    assert "session.s.overlay" not in bus._handlers


async def test_a_session_that_is_not_there_is_said_so() -> None:
    with pytest.raises(NobodyAnswers):
        await WatchedSessions(MemoryBus()).join("s", Viewer(Library.open("memory:///"), None))
