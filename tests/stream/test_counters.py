from __future__ import annotations

import pytest

from bunraku.messaging.bus import MemoryBus
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
    """A viewer, so far as is counted."""

    def __init__(self, choice: tuple[int, str] | None = None) -> None:
        self.transport = FakeTransport()
        self.connection: WebSocketConnection = self.transport.open_connection(
            ViewerConnection(StreamContext.create(clock))
        )
        self.choice = choice


def test_who_comes_stays_counted_when_they_go() -> None:
    attendance, ended = StreamCounters(), []
    first, second = FakeViewer((1, "best")), FakeViewer((0, "line"))
    go = attendance.add_viewer(first, "motion", lambda: ended.append(1))
    attendance.add_viewer(second, "session", lambda: ended.append(2))
    attendance.add_viewer(FakeViewer(), "session", lambda: ended.append(3))
    assert attendance.viewers_by_kind() == {("motion",): 1, ("session",): 2}
    assert attendance.viewers_by_level() == {("1", "best"): 1, ("0", "line"): 1}
    go()
    assert ended == [1]
    assert attendance.viewers_by_kind() == {("motion",): 0, ("session",): 2}
    assert attendance.joined == {("motion",): 1, ("session",): 2}


async def test_every_byte_of_a_counted_outlet_is_counted_once() -> None:
    attendance, one, other = StreamCounters(), FakeViewer(), FakeViewer()
    attendance.count_writes(one.connection)
    one.connection.write(b"frames")
    one.connection.send_ping()
    other.connection.write(b"not counted")
    one.connection.close_with_problem(CloseConnection(TRY_AGAIN_LATER, "Too slow", "come again"))
    assert attendance.bytes == len(one.transport.sent)
    one.connection.connection_lost(None)


def test_what_waits_for_full_lines_is_known() -> None:
    attendance, full, free = StreamCounters(), FakeViewer(), FakeViewer()
    for viewer in (full, free):
        attendance.add_viewer(viewer, "session", lambda: None)
    assert attendance.unsent_bytes() == []
    full.transport.has_capacity = False
    full.connection.write(b"12345")
    assert attendance.unsent_bytes() == [5]


async def test_a_viewer_counts_what_it_is_sent_and_what_is_skipped() -> None:
    context = StreamContext.create(clock)
    attendance = context.counters
    viewer, line = ViewerConnection(context), FakeTransport()
    outlet = line.open_connection(viewer)
    attendance.count_writes(outlet)
    viewer.open(outlet)
    overlay = encode_frame(Overlay(1, 5, {}).pack())
    viewer.send_overlay(overlay)
    assert (attendance.overlays, attendance.skipped_overlays) == (1, 0)
    line.has_capacity = False
    viewer.send_overlay(overlay)
    for _ in range(4):
        viewer.send_overlay(overlay)
    # one was written and waits in the process, one waits for room, three had their places taken
    assert (attendance.overlays, attendance.skipped_overlays) == (2, 3)
    line.drain()
    assert attendance.overlays == 3
    assert attendance.bytes == len(line.sent) == 3 * len(overlay)


@pytest.mark.parametrize("times", [1, 3])
async def test_one_who_is_dropped_is_dropped_once(times: int) -> None:
    context = StreamContext.create(clock)
    attendance = context.counters
    viewer, line = ViewerConnection(context), FakeTransport()
    viewer.open(line.open_connection(viewer))
    for _ in range(times):
        viewer.disconnect(CloseConnection(TRY_AGAIN_LATER, "Too slow", "come again"))
    assert attendance.dropped == {("Too slow",): 1, (TIMEOUT_REASON,): 0}
    outlet = viewer.connection
    outlet.connection_lost(None)


def test_no_name_is_told_twice() -> None:
    told, watched = Metrics(), WatchedSessions(MemoryBus(), MotionStore.open("memory:///"), StreamContext.create(clock))
    metrics.register_metrics(told, StreamCounters(), watched)
    with pytest.raises(ValueError, match="bunraku_viewers"):
        metrics.register_metrics(told, StreamCounters(), watched)
