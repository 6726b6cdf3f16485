from __future__ import annotations

import pytest

from bunraku.messaging.bus import MemoryBus
from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.runtime.clock import clock
from bunraku.runtime.metrics import Metrics
from bunraku.storage.motion_store import MotionStore
from bunraku.stream import metrics
from bunraku.stream.context import StreamContext
from bunraku.stream.counters import TIMEOUT_REASON, StreamCounters
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSessions
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.subprotocol import TRY_AGAIN_LATER, CloseConnection
from bunraku.wire.overlay import Overlay
from tests.stream.fake_transport import FakeTransport


class FakeViewer:
    """Viewer, as far as it is counted."""

    def __init__(self, choice: tuple[int, str] | None = None) -> None:
        self.transport = FakeTransport()
        self.connection: WebSocketConnection = self.transport.open_connection(
            ViewerConnection(StreamContext.create(clock))
        )
        self.choice = choice


def test_joined_viewers_stay_counted_after_leaving() -> None:
    counters, ended = StreamCounters(), []
    first, second = FakeViewer((1, "best")), FakeViewer((0, "line"))
    leave = counters.add_viewer(first, "motion", lambda: ended.append(1))
    counters.add_viewer(second, "session", lambda: ended.append(2))
    counters.add_viewer(FakeViewer(), "session", lambda: ended.append(3))
    assert counters.viewers_by_kind() == {("motion",): 1, ("session",): 2}
    assert counters.viewers_by_level() == {("1", "best"): 1, ("0", "line"): 1}
    leave()
    assert ended == [1]
    assert counters.viewers_by_kind() == {("motion",): 0, ("session",): 2}
    assert counters.joined == {("motion",): 1, ("session",): 2}


async def test_bytes_of_counted_connection_are_counted_once() -> None:
    counters, one, other = StreamCounters(), FakeViewer(), FakeViewer()
    counters.count_writes(one.connection)
    one.connection.write(b"frames")
    one.connection.send_ping()
    other.connection.write(b"not counted")
    one.connection.close_with_problem(CloseConnection(TRY_AGAIN_LATER, "Too slow", "come again"))
    assert counters.bytes == len(one.transport.sent)
    one.connection.connection_lost(None)


async def test_unsent_bytes_are_those_of_unwritable_connections() -> None:
    counters, full, free = StreamCounters(), FakeViewer(), FakeViewer()
    for viewer in (full, free):
        counters.add_viewer(viewer, "session", lambda: None)
    assert counters.unsent_bytes() == []
    full.transport.has_capacity = False
    full.connection.write(b"12345")
    assert counters.unsent_bytes() == [5]


async def test_sent_and_skipped_overlays_are_counted() -> None:
    context = StreamContext.create(clock)
    counters = context.counters
    viewer, transport = ViewerConnection(context), FakeTransport()
    connection = transport.open_connection(viewer)
    counters.count_writes(connection)
    viewer.open(connection)
    overlay = encode_frame(Overlay(1, 5, {}).pack())
    viewer.send_newest(overlay)
    assert (counters.overlays, counters.skipped_overlays) == (1, 0)
    transport.has_capacity = False
    viewer.send_newest(overlay)
    for _ in range(4):
        viewer.send_newest(overlay)
    # one is buffered in the process, one is queued, three were replaced
    assert (counters.overlays, counters.skipped_overlays) == (2, 3)
    transport.drain()
    assert counters.overlays == 3
    assert counters.bytes == len(transport.sent) == 3 * len(overlay)


@pytest.mark.parametrize("times", [1, 3])
async def test_disconnected_viewer_is_counted_once(times: int) -> None:
    context = StreamContext.create(clock)
    counters = context.counters
    viewer, transport = ViewerConnection(context), FakeTransport()
    viewer.open(transport.open_connection(viewer))
    for _ in range(times):
        viewer.disconnect(CloseConnection(TRY_AGAIN_LATER, "Too slow", "come again"))
    assert counters.dropped == {("Too slow",): 1, (TIMEOUT_REASON,): 0}
    connection = viewer.connection
    connection.connection_lost(None)


def test_metrics_cannot_be_registered_twice() -> None:
    registry, watched = (
        Metrics(),
        WatchedSessions(
            MemoryBus(), MemoryKeyValueStore(), MotionStore.open("memory:///"), StreamContext.create(clock)
        ),
    )
    metrics.register_metrics(registry, StreamCounters(), watched)
    with pytest.raises(ValueError, match="bunraku_viewers"):
        metrics.register_metrics(registry, StreamCounters(), watched)
