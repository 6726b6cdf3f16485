from __future__ import annotations

from bunraku.websocket.connection import BinaryListener, WebSocketConnection
from bunraku.websocket.heartbeat import HEARTBEAT_TIMEOUT_US, PING_AFTER_US, Heartbeat
from tests.stream.fake_transport import FakeTransport

RECEIVED_AT = 10**9


class NullListener(BinaryListener):
    def on_message(self, message: bytes) -> None: ...

    def on_pong(self, _: bytes) -> bool:
        return False

    def on_pause(self) -> None: ...

    def on_resume(self) -> None: ...

    def on_close(self) -> None: ...


def silent_connection() -> tuple[WebSocketConnection, FakeTransport]:
    transport = FakeTransport()
    connection = transport.open_connection(NullListener())
    connection.last_received_at = RECEIVED_AT
    return connection, transport


async def test_silent_viewer_is_pinged_once_and_times_out() -> None:
    connection, transport = silent_connection()
    heartbeat = Heartbeat()
    assert heartbeat.check(connection, RECEIVED_AT + PING_AFTER_US)
    assert transport.sent == b""
    due = heartbeat.next_check(connection)
    assert due == RECEIVED_AT + PING_AFTER_US + 1
    assert heartbeat.check(connection, due)
    ping = transport.sent
    assert len(ping) > 0
    assert heartbeat.check(connection, due + 1_000_000)
    assert transport.sent == ping
    assert heartbeat.next_check(connection) == RECEIVED_AT + HEARTBEAT_TIMEOUT_US + 1
    assert heartbeat.check(connection, RECEIVED_AT + HEARTBEAT_TIMEOUT_US)
    assert not heartbeat.check(connection, RECEIVED_AT + HEARTBEAT_TIMEOUT_US + 1)


async def test_answering_viewer_is_pinged_again_when_silent_again() -> None:
    connection, transport = silent_connection()
    heartbeat = Heartbeat()
    assert heartbeat.check(connection, RECEIVED_AT + PING_AFTER_US + 1)
    ping = transport.sent
    connection.last_received_at = RECEIVED_AT + PING_AFTER_US + 50_000
    assert heartbeat.next_check(connection) == connection.last_received_at + PING_AFTER_US + 1
    assert heartbeat.check(connection, RECEIVED_AT + HEARTBEAT_TIMEOUT_US + 1)
    assert transport.sent == ping
    assert heartbeat.check(connection, heartbeat.next_check(connection))
    assert transport.sent == 2 * ping
