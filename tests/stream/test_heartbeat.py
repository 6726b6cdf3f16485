"""Who says nothing is asked once, and given up when nothing comes."""

from __future__ import annotations

from bunraku.stream.heartbeat import HEARTBEAT_TIMEOUT_US, PING_AFTER_US, Heartbeat
from bunraku.websocket.connection import WebSocketConnection
from tests.stream.fake_transport import FakeTransport


class NullListener:
    def on_message(self, message: bytes) -> None: ...

    def on_pong(self, payload: bytes) -> None: ...

    def on_pause(self) -> None: ...

    def on_resume(self) -> None: ...

    def on_close(self) -> None: ...


def silent_connection(heard: int) -> tuple[WebSocketConnection, FakeTransport]:
    line = FakeTransport()
    outlet = line.open_connection(NullListener())
    outlet.last_received_at = heard
    return outlet, line


async def test_one_who_is_silent_is_asked_once_and_then_given_up() -> None:
    heard = 10**9
    outlet, line = silent_connection(heard)
    liveness = Heartbeat()
    assert liveness.check(outlet, heard + PING_AFTER_US)
    assert line.sent == b""
    due = liveness.next_check(outlet)
    assert due == heard + PING_AFTER_US + 1
    assert liveness.check(outlet, due)
    asked = line.sent
    assert len(asked) > 0
    assert liveness.check(outlet, due + 1_000_000)
    assert line.sent == asked
    assert liveness.next_check(outlet) == heard + HEARTBEAT_TIMEOUT_US + 1
    assert liveness.check(outlet, heard + HEARTBEAT_TIMEOUT_US)
    assert not liveness.check(outlet, heard + HEARTBEAT_TIMEOUT_US + 1)


async def test_one_who_answers_is_there_and_is_asked_again_when_it_falls_silent_again() -> None:
    heard = 10**9
    outlet, line = silent_connection(heard)
    liveness = Heartbeat()
    assert liveness.check(outlet, heard + PING_AFTER_US + 1)
    asked = line.sent
    outlet.last_received_at = heard + PING_AFTER_US + 50_000
    assert liveness.next_check(outlet) == outlet.last_received_at + PING_AFTER_US + 1
    assert liveness.check(outlet, heard + HEARTBEAT_TIMEOUT_US + 1)
    assert line.sent == asked
    assert liveness.check(outlet, liveness.next_check(outlet))
    assert line.sent == 2 * asked
