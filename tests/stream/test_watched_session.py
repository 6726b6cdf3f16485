from __future__ import annotations

import asyncio
from collections.abc import Callable

import msgpack
import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.marionette.crowd.summary import CrowdSummary
from bunraku.messaging.bus import MemoryBus, NoResponse
from bunraku.messaging.key_value import KeyValueView, MemoryKeyValueStore
from bunraku.playout import timeline
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.storage.motion_store import MotionStore
from bunraku.stream import watched_session
from bunraku.stream.context import StreamContext
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSessions
from bunraku.websocket.frame import Opcode, encode_frame
from bunraku.websocket.subprotocol import NOT_FOUND, SERVICE_RESTART, CloseConnection
from bunraku.wire.messages import (
    ChannelHeader,
    CrowdPulls,
    CrowdTurn,
    Description,
    Presence,
    Problem,
    Pull,
    TimelineState,
)
from bunraku.wire.overlay import Overlay
from tests.stream.fake_transport import FakeTransport, parse_frames
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion

STATE = timeline.start("m", 2_000_000, 1_000)
PRESENCE = Presence(0, [], [None] * 4)


@pytest.fixture
async def motion_store() -> MotionStore:
    store = MotionStore.open("memory:///")
    encoded = encode_motion(random_motion(2.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    for name in ("m", "n"):
        await store.put(name, pack_motion(name, encoded))
    return store


def close_codes(transport: FakeTransport) -> list[int]:
    """Return the codes of the Close frames that were sent."""
    return [
        int.from_bytes(payload[:2], "big") for opcode, payload in parse_frames(transport.sent) if opcode == Opcode.CLOSE
    ]


def serve_session_state(bus: MemoryBus, state: TimelineState = STATE) -> list[int]:
    """Serve a session on the bus; return the list of viewer counts that it receives."""

    async def answer(_: bytes) -> bytes:
        packed: bytes = msgpack.packb([state.pack(), PRESENCE.pack(), Overlay(1, 5, {}).pack()])
        return packed

    counts: list[int] = []
    bus.serve("session.s.state", answer)
    bus.subscribe("session.s.viewers", lambda message: counts.append(msgpack.unpackb(message)[1]))
    return counts


async def open_session(watched: WatchedSessions, session: str = "s") -> None:
    """Open a session without adding a viewer."""
    async with watched.open(session):
        pass


async def join_viewer(watched: WatchedSessions, session_id: str = "s") -> tuple[ViewerConnection, FakeTransport]:
    viewer, transport = ViewerConnection(watched._context), FakeTransport()
    async with watched.open(session_id) as session:
        session.add_viewer(viewer)
        viewer.open(transport.open_connection(viewer))
    return viewer, transport


async def test_one_subscription_serves_all_viewers_until_last_leaves(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(3)]
    assert len(bus._handlers["session.s.overlay"]) == 1
    overlay = Overlay(2, 6, {1: (0,) * 9}).pack()
    bus.publish("session.s.overlay", overlay)
    assert all(transport.sent.endswith(encode_frame(overlay)) for _, transport in joined)
    joined.append(await join_viewer(watched))
    assert encode_frame(overlay) in joined[-1][1].sent
    edited = timeline.edit(STATE, 2_000, playing=False)
    bus.publish("session.s.timeline", edited.pack())
    assert all(edited in transport.messages for _, transport in joined)
    for viewer, _ in joined:
        viewer.on_close()
    assert "session.s.overlay" not in bus._handlers
    assert not watched._sessions


async def test_pulls_of_viewers_are_summarised_for_the_owner_and_its_sample_is_sent(motion_store: MotionStore) -> None:
    bus, summaries = MemoryBus(), asyncio.Queue[bytes]()
    serve_session_state(bus)
    bus.subscribe("session.s.crowd", summaries.put_nowait)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(3)]
    joined[0][0].on_message(Pull(1, [0.5, 0.0, 0.0]).pack())
    presence = Presence(3, [], [None] * 4, crowd=[{"limb": 1, "policy": "median", "pulls": 0}])
    bus.publish("session.s.presence", presence.pack())
    for viewer, _ in joined[:2]:
        viewer.on_message(Pull(1, [0.5, 0.0, 0.0]).pack())
        viewer.on_message(Pull(0, [0.5, 0.0, 0.0]).pack())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        _, limb, _, packed = msgpack.unpackb(await summaries.get())
    assert (limb, CrowdSummary.unpack(packed).count) == (1, 2)
    pulls = CrowdPulls(1, 2, [[0.5, 0.0, 0.0]])
    bus.publish("session.s.pulls", pulls.pack())
    assert pulls in joined[0][1].messages
    turn = CrowdSummary.unpack(packed).turn
    assert turn is not None
    bus.publish("session.s.turn", msgpack.packb([1, -turn.negative_turn, turn.rank]))
    assert sum(CrowdTurn(1, True) in transport.messages for _, transport in joined) == 1
    for viewer, _ in joined:
        viewer.on_close()
    assert "session.s.pulls" not in bus._handlers


async def test_slow_viewer_gets_newest_overlay_without_delaying_others(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    (_, slow), (_, quick) = [await join_viewer(watched) for _ in range(2)]
    slow.has_capacity = False
    for number in range(10, 20):
        bus.publish("session.s.overlay", Overlay(number, 6, {1: (0,) * 9}).pack())

    def sequences(transport: FakeTransport) -> list[int]:
        return [m.sequence for m in transport.messages if isinstance(m, Overlay)]

    assert sequences(quick) == [1, *range(10, 20)]
    assert sequences(slow) == [1]
    slow.drain()
    assert sequences(slow) == [1, 10, 19]
    bus.publish("session.s.overlay", Overlay(20, 6, {1: (0,) * 9}).pack())
    assert sequences(slow)[-1] == sequences(quick)[-1] == 20


async def test_viewer_counts_are_throttled(motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched_session, "VIEWER_COUNT_INTERVAL_S", 0.02)
    bus = MemoryBus()
    counts = serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(40)]
    assert len(counts) < 20
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while counts[-1] != 40:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
    for viewer, _ in joined:
        viewer.on_close()
    assert counts[-1] == 0


async def test_unchanged_viewer_count_is_published_again(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watched_session, "VIEWER_COUNT_REFRESH_S", 0.02)
    bus = MemoryBus()
    counts = serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    viewer, _ = await join_viewer(watched)
    session = watched._sessions["s"]
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while counts[-4:] != [1] * 4:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
    viewer.on_close()
    assert counts[-1] == 0
    assert session._refresh_timer is not None
    assert session._refresh_timer.cancelled()


async def test_state_is_requested_again_after_bus_reconnects(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = MemoryBus()
    callbacks: list[Callable[[], None]] = []
    monkeypatch.setattr(bus, "on_reconnect", callbacks.append)
    state: list[bytes | None] = [STATE.pack(), PRESENCE.pack(), Overlay(1, 5, {2: (0,) * 9}).pack()]

    async def answer(_: bytes) -> bytes:
        packed: bytes = msgpack.packb(state)
        return packed

    bus.serve("session.s.state", answer)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    viewer, transport = await join_viewer(watched)
    await asyncio.gather(*watched._resync_tasks)
    assert [m.limbs.keys() for m in transport.messages if isinstance(m, Overlay)] == [{2}]
    edited, presence = timeline.edit(STATE, 2_000, playing=False), Presence(1, [{"id": "a"}], [None] * 4)
    state[:] = [edited.pack(), presence.pack(), None]
    callbacks[0]()
    await asyncio.gather(*watched._resync_tasks)
    assert edited in transport.messages
    assert presence in transport.messages
    assert [m.limbs.keys() for m in transport.messages if isinstance(m, Overlay)] == [{2}, set()]
    viewer.on_close()


async def test_state_is_requested_until_the_owner_answers(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watched_session, "RESYNCHRONISATION_RETRY_S", 0.0)
    bus = MemoryBus()
    callbacks: list[Callable[[], None]] = []
    monkeypatch.setattr(bus, "on_reconnect", callbacks.append)
    state, outages = [STATE.pack(), PRESENCE.pack(), None], 0

    async def answer(_: bytes) -> bytes:
        nonlocal outages
        if outages:
            outages -= 1
            raise BackendUnavailable("the bus", "the owner is cut off")
        packed: bytes = msgpack.packb(state)
        return packed

    bus.serve("session.s.state", answer)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    viewer, transport = await join_viewer(watched)
    await asyncio.gather(*watched._resync_tasks)
    edited = timeline.edit(STATE, 2_000, playing=False)
    state[0], outages = edited.pack(), 3
    callbacks[0]()
    await asyncio.gather(*watched._resync_tasks)
    assert edited in transport.messages
    # nothing is requested for a session that nobody watches any more
    outages = 1_000_000
    callbacks[0]()
    viewer.on_close()
    await asyncio.gather(*watched._resync_tasks)


async def test_silent_owner_delays_no_other_session(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    states, silent = {"s": STATE, "other": STATE}, False

    def serve_state(session: str) -> None:
        async def answer(_: bytes) -> bytes:
            if silent and session == "s":
                await asyncio.Event().wait()
            packed: bytes = msgpack.packb([states[session].pack(), PRESENCE.pack(), None])
            return packed

        bus.serve(f"session.{session}.state", answer)

    for session in states:
        serve_state(session)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched, session) for session in states]
    await asyncio.gather(*watched._resync_tasks)
    edited = states["other"] = timeline.edit(STATE, 2_000, playing=False)
    silent = True
    watched._resynchronise(*watched._sessions.values())
    await asyncio.wait(watched._resync_tasks, return_when=asyncio.FIRST_COMPLETED)
    assert edited in joined[1][1].messages
    await watched.close()


async def test_viewer_count_is_published_after_session_takeover(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    counts = serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(3)]
    counts.clear()
    bus.publish("session.s.appear", b"")
    assert counts == [3]
    for viewer, _ in joined:
        viewer.on_close()


@pytest.mark.parametrize("session", ["*", ">", "s.state", ""])
async def test_invalid_session_id_is_not_requested(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch, session: str
) -> None:
    bus, requested = MemoryBus(), []

    async def request(subject: str, *_: object) -> bytes:
        requested.append(subject)
        return b""

    monkeypatch.setattr(bus, "request", request)
    with pytest.raises(NoResponse):
        await open_session(
            WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock)), session
        )
    assert requested == []


async def test_motion_change_reaches_all_viewers(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(2)]
    other = timeline.change_motion(STATE, 5_000, "n", 2_000_000)
    bus.publish("session.s.timeline", other.pack())
    await open_session(watched)
    assert all(other in transport.messages for _, transport in joined)
    bus.publish("session.s.timeline", timeline.change_motion(other, 6_000, "gone", 2_000_000).pack())
    with pytest.raises(CloseConnection) as closed:
        await open_session(watched)
    assert closed.value.code == NOT_FOUND
    assert all(b"No such motion" in transport.sent for _, transport in joined)


async def test_viewer_that_joins_during_a_motion_change_gets_both_motions(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    viewer, transport = ViewerConnection(watched._context), FakeTransport()
    other = timeline.change_motion(STATE, 5_000, "n", 2_000_000)
    async with watched.open("s") as session:
        # during the handshake, the motion is changed and begins to load
        bus.publish("session.s.timeline", other.pack())
        session.add_viewer(viewer)
        viewer.open(transport.open_connection(viewer))
        await session.wait_until_ready()
    announced = [m for m in transport.messages if isinstance(m, ChannelHeader | Description | TimelineState)]
    assert [m if isinstance(m, TimelineState) else m.motion for m in announced] == ["m", "m", STATE, "n", "n", other]
    viewer.on_close()


async def test_unknown_session_raises_no_response(motion_store: MotionStore) -> None:
    with pytest.raises(NoResponse):
        await open_session(
            WatchedSessions(MemoryBus(), MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
        )


async def test_session_without_motion_is_rejected_and_closed(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    counts = serve_session_state(bus, timeline.start("none", 2_000_000, 1_000))
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    with pytest.raises(CloseConnection) as closed:
        await open_session(watched)
    assert closed.value.code == NOT_FOUND
    assert not watched._sessions
    assert counts == []


async def test_viewers_of_a_deleted_session_are_disconnected_with_reason(motion_store: MotionStore) -> None:
    bus, key_values = MemoryBus(), MemoryKeyValueStore()
    counts = serve_session_state(bus)
    await key_values.put("sessions.s", b"1")
    await key_values.put("sessions.other", b"1")
    watched = WatchedSessions(bus, key_values, motion_store, StreamContext.create(clock))
    joined = [await join_viewer(watched) for _ in range(2)]
    await key_values.remove("sessions.other")
    await key_values.put("sessions.s", b"2")
    assert [close_codes(transport) for _, transport in joined] == [[], []]
    await key_values.remove("sessions.s")
    for viewer, transport in joined:
        assert close_codes(transport) == [NOT_FOUND]
        assert [m.title for m in transport.messages if isinstance(m, Problem)] == ["Session ended"]
        viewer.on_close()
    assert "session.s.overlay" not in bus._handlers
    assert len(watched) == 0
    assert counts[-1] == 0
    # a new session with the same id is another one
    await key_values.put("sessions.s", b"3")
    viewer, transport = await join_viewer(watched)
    assert close_codes(transport) == []
    await watched.close()


async def test_session_that_ended_during_an_outage_is_noticed(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, key_values = MemoryBus(), MemoryKeyValueStore()
    callbacks: list[Callable[[], None]] = []
    monkeypatch.setattr(bus, "on_reconnect", callbacks.append)
    # the watch does not report the removal
    monkeypatch.setattr(key_values, "watch", KeyValueView)
    monkeypatch.setattr(watched_session, "RESYNCHRONISATION_RETRY_S", 0.0)
    serve_session_state(bus)
    await key_values.put("sessions.s", b"1")
    watched = WatchedSessions(bus, key_values, motion_store, StreamContext.create(clock))
    _, transport = await join_viewer(watched)
    await asyncio.gather(*watched._resync_tasks)
    bus._responders.clear()
    callbacks[0]()
    for _ in range(20):
        await asyncio.sleep(0)
    # the owner may be unavailable
    assert close_codes(transport) == []
    await key_values.remove("sessions.s")
    await asyncio.gather(*watched._resync_tasks)
    assert close_codes(transport) == [NOT_FOUND]


async def test_close_ends_all_subscriptions_and_tasks(
    motion_store: MotionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watched_session, "RESYNCHRONISATION_RETRY_S", 1_000_000.0)
    bus, key_values = MemoryBus(), MemoryKeyValueStore()
    serve_session_state(bus)
    await key_values.put("sessions.s", b"1")
    watched = WatchedSessions(bus, key_values, motion_store, StreamContext.create(clock))
    viewer, transport = await join_viewer(watched)
    bus._responders.clear()
    watched._resynchronise(*watched._sessions.values())
    await asyncio.sleep(0)
    tasks = tuple(watched._resync_tasks)
    assert tasks
    await watched.close()
    assert all(task.done() for task in tasks)
    assert not bus._handlers.keys() & {f"session.s.{name}" for name in ("timeline", "presence", "overlay", "appear")}
    # not an end of the session
    await key_values.remove("sessions.s")
    assert close_codes(transport) == []
    viewer.on_close()


async def test_viewer_that_waits_for_the_motion_is_rejected_when_the_server_stops(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    joining = asyncio.create_task(join_viewer(watched))
    while not watched._sessions:  # noqa: ASYNC110
        await asyncio.sleep(0)
    await watched.close()
    with pytest.raises(CloseConnection) as closed:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await joining
    assert closed.value.code == SERVICE_RESTART


async def test_viewer_of_a_session_that_ends_during_the_handshake_is_not_added(motion_store: MotionStore) -> None:
    bus, key_values = MemoryBus(), MemoryKeyValueStore()
    counts = serve_session_state(bus)
    await key_values.put("sessions.s", b"1")
    watched = WatchedSessions(bus, key_values, motion_store, StreamContext.create(clock))
    viewer, transport = ViewerConnection(watched._context), FakeTransport()
    async with watched.open("s") as session:
        await key_values.remove("sessions.s")
        session.add_viewer(viewer)
        viewer.open(transport.open_connection(viewer))
        assert session.close_reason is not None
        viewer.disconnect(session.close_reason)
    assert close_codes(transport) == [NOT_FOUND]
    viewer.on_close()
    # nothing is published for it any more
    assert counts == []
    assert session._refresh_timer is session._count_timer is None


async def test_state_of_a_later_release_is_understood(motion_store: MotionStore) -> None:
    bus, key_values = MemoryBus(), MemoryKeyValueStore()

    async def answer(_: bytes) -> bytes:
        packed: bytes = msgpack.packb([STATE.pack(), PRESENCE.pack(), None, {"more": 1}])
        return packed

    bus.serve("session.s.state", answer)
    watched = WatchedSessions(bus, key_values, motion_store, StreamContext.create(clock))
    _, transport = await join_viewer(watched)
    await asyncio.gather(*watched._resync_tasks)
    assert STATE in transport.messages
    await watched.close()


async def test_viewer_that_leaves_early_keeps_the_session_open_for_another(motion_store: MotionStore) -> None:
    bus = MemoryBus()
    serve_session_state(bus)
    watched = WatchedSessions(bus, MemoryKeyValueStore(), motion_store, StreamContext.create(clock))
    # both wait for the motion; the first is gone by then
    _, (viewer, transport) = await asyncio.gather(open_session(watched), join_viewer(watched))
    edited = timeline.edit(STATE, 2_000, playing=False)
    bus.publish("session.s.timeline", edited.pack())
    assert edited in transport.messages
    viewer.on_close()
    assert not watched._sessions
