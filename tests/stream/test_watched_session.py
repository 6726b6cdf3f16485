from __future__ import annotations

import asyncio
from collections.abc import Callable

import msgpack
import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.messaging.bus import MemoryBus, NoResponse
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.storage.motion_store import MotionStore
from bunraku.stream import watched_session
from bunraku.stream.context import StreamContext
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSessions
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.subprotocol import NOT_FOUND, CloseConnection
from bunraku.wire.messages import Presence, TimelineState
from bunraku.wire.overlay import Overlay
from tests.stream.fake_transport import FakeTransport
from tests.vectors.blocks import random_motion

STATE = timeline.start("m", 2_000_000, 1_000)
PRESENCE = Presence(0, [], [None] * 4)


@pytest.fixture
async def library() -> MotionStore:
    shelf = MotionStore.open("memory:///")
    encoded = encode_motion(random_motion(2.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    for name in ("m", "n"):
        await shelf.put(name, pack_motion(name, encoded))
    return shelf


def serve_session_state(bus: MemoryBus, state: TimelineState = STATE) -> list[int]:
    """A session on the bus; what it hears of how many viewers there are."""

    async def answer(_: bytes) -> bytes:
        packed: bytes = msgpack.packb([state.pack(), PRESENCE.pack(), Overlay(1, 5, {}).pack()])
        return packed

    heard: list[int] = []
    bus.serve("session.s.state", answer)
    bus.subscribe("session.s.viewers", lambda message: heard.append(msgpack.unpackb(message)[1]))
    return heard


async def join_viewer(watched: WatchedSessions) -> tuple[ViewerConnection, FakeTransport]:
    viewer, line = ViewerConnection(watched._context), FakeTransport()
    (await watched.open("s")).add_viewer(viewer)
    viewer.open(line.open_connection(viewer))
    return viewer, line


async def test_one_subscription_serves_all_viewers_and_ends_with_the_last(library: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    there = [await join_viewer(watched) for _ in range(3)]
    assert len(bus._handlers["session.s.overlay"]) == 1
    pulled = Overlay(2, 6, {1: (0,) * 9}).pack()
    bus.publish("session.s.overlay", pulled)
    assert all(line.sent.endswith(encode_frame(pulled)) for _, line in there)
    there.append(await join_viewer(watched))
    assert encode_frame(pulled) in there[-1][1].sent
    edited = timeline.edit(STATE, 2_000, playing=False)
    bus.publish("session.s.timeline", edited.pack())
    assert all(edited in line.messages for _, line in there)
    for viewer, _ in there:
        viewer.on_close()
    assert "session.s.overlay" not in bus._handlers
    assert not watched._sessions


async def test_one_without_room_gets_the_newest_and_holds_up_nobody(library: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    (_, slow), (_, quick) = [await join_viewer(watched) for _ in range(2)]
    slow.has_capacity = False
    for number in range(10, 20):
        bus.publish("session.s.overlay", Overlay(number, 6, {1: (0,) * 9}).pack())

    def sequences(line: FakeTransport) -> list[int]:
        return [m.sequence for m in line.messages if isinstance(m, Overlay)]

    assert sequences(quick) == [1, *range(10, 20)]
    assert sequences(slow) == [1]
    slow.drain()
    assert sequences(slow) == [1, 10, 19]
    bus.publish("session.s.overlay", Overlay(20, 6, {1: (0,) * 9}).pack())
    assert sequences(slow)[-1] == sequences(quick)[-1] == 20


async def test_many_who_come_and_go_are_counted_seldom(library: MotionStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched_session, "VIEWER_COUNT_INTERVAL_S", 0.02)
    bus = MemoryBus()
    heard = serve_session_state(bus)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    there = [await join_viewer(watched) for _ in range(40)]
    assert len(heard) < 20
    async with asyncio.timeout(10):
        while heard[-1] != 40:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
    for viewer, _ in there:
        viewer.on_close()
    assert heard[-1] == 0


async def test_what_was_published_while_the_bus_was_away_is_asked_for(
    library: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = MemoryBus()
    returned: list[Callable[[], None]] = []
    monkeypatch.setattr(bus, "on_reconnect", returned.append)
    state: list[bytes | None] = [STATE.pack(), PRESENCE.pack(), Overlay(1, 5, {2: (0,) * 9}).pack()]

    async def answer(_: bytes) -> bytes:
        packed: bytes = msgpack.packb(state)
        return packed

    bus.serve("session.s.state", answer)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    viewer, line = await join_viewer(watched)
    await asyncio.gather(*watched._resync_tasks)
    assert [m.limbs.keys() for m in line.messages if isinstance(m, Overlay)] == [{2}]
    edited, left = timeline.edit(STATE, 2_000, playing=False), Presence(1, [{"id": "a"}], [None] * 4)
    state[:] = [edited.pack(), left.pack(), None]
    returned[0]()
    await asyncio.gather(*watched._resync_tasks)
    assert edited in line.messages
    assert left in line.messages
    assert [m.limbs.keys() for m in line.messages if isinstance(m, Overlay)] == [{2}, set()]
    viewer.on_close()


async def test_a_session_that_goes_on_elsewhere_hears_how_many_watch(library: MotionStore) -> None:
    bus = MemoryBus()
    heard = serve_session_state(bus)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    there = [await join_viewer(watched) for _ in range(3)]
    heard.clear()
    bus.publish("session.s.appear", b"")
    assert heard == [3]
    for viewer, _ in there:
        viewer.on_close()


@pytest.mark.parametrize("session", ["*", ">", "s.state", ""])
async def test_what_cannot_be_a_session_is_not_asked_for(
    library: MotionStore, monkeypatch: pytest.MonkeyPatch, session: str
) -> None:
    bus, asked = MemoryBus(), []

    async def ask(subject: str, *_: object) -> bytes:
        asked.append(subject)
        return b""

    monkeypatch.setattr(bus, "request", ask)
    with pytest.raises(NoResponse):
        await WatchedSessions(bus, library, StreamContext.create(clock)).open(session)
    assert asked == []


async def test_another_motion_comes_to_all(library: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    there = [await join_viewer(watched) for _ in range(2)]
    other = timeline.change_motion(STATE, 5_000, "n", 2_000_000)
    bus.publish("session.s.timeline", other.pack())
    await (await watched.open("s")).wait_until_ready()
    assert all(other in line.messages for _, line in there)
    bus.publish("session.s.timeline", timeline.change_motion(other, 6_000, "gone", 2_000_000).pack())
    with pytest.raises(CloseConnection) as refused:
        await watched.open("s")
    assert refused.value.code == NOT_FOUND
    assert all(b"No such motion" in line.sent for _, line in there)


async def test_a_session_that_is_not_there_is_said_so(library: MotionStore) -> None:
    with pytest.raises(NoResponse):
        await WatchedSessions(MemoryBus(), library, StreamContext.create(clock)).open("s")


async def test_a_session_whose_motion_is_not_there_is_refused_and_let_go(library: MotionStore) -> None:
    bus = MemoryBus()
    heard = serve_session_state(bus, timeline.start("none", 2_000_000, 1_000))
    watched = WatchedSessions(bus, library, StreamContext.create(clock))
    with pytest.raises(CloseConnection) as refused:
        await watched.open("s")
    assert refused.value.code == NOT_FOUND
    assert not watched._sessions
    assert heard == []
