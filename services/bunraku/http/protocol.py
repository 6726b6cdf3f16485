"""uvicorn's HTTP protocol with bounds: on request heads, on the time for them, on parsing, and on slow readers."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from enum import Enum, auto
from http import HTTPStatus
from typing import Any, cast

import h11
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.h11_impl import H11Protocol

from bunraku.http.problem_details import MEDIA_TYPE
from bunraku.http.request_head import BoundedConnection
from bunraku.runtime.client_network import peer_network
from bunraku.runtime.input_scheduler import InputScheduler
from bunraku.runtime.transport import LingeringClose, WriteDeadline, set_receive_buffer, set_send_buffer

HEADER_TIMEOUT_S = 10.0
"""Time for complete request headers, from the start of the connection or the first byte. Also the time for the rest of
a body after the response; closing the connection at once would discard the response."""
MAX_WAITING_CONNECTIONS = 1_000
"""Connections of a server that wait for request headers. The one that has waited longest makes room for a new one."""
MIN_PARSE_BYTES = 1 << 10
MAX_PARSE_BYTES = 64 << 10
"""Least and most bytes that are parsed at once. A piece of chunked data may take a thousand times longer than its size
suggests, so the number adapts to the time that the last piece took."""
SEND_BUFFER_BYTES = 64 << 10
"""Kernel send buffer of a connection. Requests of a client that does not read wait once it is full; by default it would
grow to megabytes. It suffices for 1 MB/s at a round-trip time of 100 ms."""
RECEIVE_BUFFER_BYTES = 16 << 10
"""Kernel receive buffer of a connection: no more arrives at once. A thousand connections may wait for their turns."""
BODY_RECEIVE_BUFFER_BYTES = 256 << 10
"""The same once the application reads a body."""
PARSE_TIME_S = 1e-3
"""Time after which parsing of a connection's data pauses for other connections."""

_log = logging.getLogger(__name__)
# the base class warns of each malformed request; clients get the reason, and the log stays readable
_log.setLevel(logging.ERROR)


class HttpLoad:
    """Connections of one server that wait: for request headers, or for their turn to be parsed."""

    def __init__(self) -> None:
        self.waiting_for_head: dict[HttpProtocol, None] = {}
        """Connections without a complete request head, the oldest first."""
        # a request costs far more than its head: one is begun in each iteration of the event loop
        self.input = InputScheduler(0)


class _ResponseTransport:
    """Transport as uvicorn's response uses it: closing it does not discard the response."""

    def __init__(self, protocol: HttpProtocol) -> None:
        self._protocol = protocol

    def write(self, data: bytes) -> None:
        self._protocol.transport.write(data)

    def is_closing(self) -> bool:
        return self._protocol.transport.is_closing()

    def close(self) -> None:
        self._protocol.close_after_response()


class _BodyFlow(FlowControl):
    """Flow control that receives faster once the application reads a body, which it does only if it is permitted."""

    def __init__(self, transport: asyncio.Transport, connection: h11.Connection) -> None:
        super().__init__(transport)
        self._connection = connection
        self._reads_body = False

    def resume_reading(self) -> None:
        """Read more from the client. Until the response is complete, the application waits for more of the body."""
        is_body_awaited = self._connection.their_state is h11.SEND_BODY and self._connection.our_state is not h11.DONE
        if is_body_awaited and not self._reads_body:
            self._reads_body = True
            set_receive_buffer(self._transport, BODY_RECEIVE_BUFFER_BYTES)
        super().resume_reading()


class _Turn(Enum):
    """Turn of a connection at the `InputScheduler`."""

    NONE = auto()
    AWAITED = auto()
    TAKEN = auto()


class HttpProtocol(H11Protocol):
    """HTTP protocol of a server with untrusted clients.

    A connection whose request headers are late, or whose client does not read its responses, is aborted. It overrides
    methods of the base class that uvicorn does not document; `pyproject.toml` bounds its version, and
    `tests/test_library_interfaces.py` checks them.
    """

    def __init__(self, load: HttpLoad, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._load = load
        self.logger = _log
        self.conn: BoundedConnection = BoundedConnection()
        self._header_timer: asyncio.TimerHandle | None = None
        self._unparsed = bytearray()
        self._parse_bytes = MIN_PARSE_BYTES
        self._turn = _Turn.NONE

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        # the base class adds the connection to those of the server, which may abort it
        self.transport, self.source = transport, peer_network(transport)
        super().connection_made(transport)
        # responses continue when the buffer is empty
        transport.set_write_buffer_limits(0, 0)
        set_send_buffer(transport, SEND_BUFFER_BYTES)
        set_receive_buffer(transport, RECEIVE_BUFFER_BYTES)
        self.flow = _BodyFlow(transport, self.conn)
        self._write_deadline = WriteDeadline(transport)
        self._start_timeout()

    def data_received(self, data: bytes) -> None:
        self._unparsed += data
        if self._turn is _Turn.AWAITED:
            # reading was resumed at the end of a response
            self.transport.pause_reading()
        else:
            self._await_turn()

    def handle_events(self) -> None:
        """Begin the next request of the parsed data, or wait for a turn to do so after a response."""
        if self._turn is _Turn.TAKEN:
            super().handle_events()
            if self.cycle is not None:
                self.cycle.transport = cast(asyncio.Transport, _ResponseTransport(self))
        elif self._turn is _Turn.NONE:
            self._await_turn()

    def _await_turn(self) -> None:
        self._turn = _Turn.AWAITED
        self._load.input.schedule(self)

    def pause_reading(self) -> None:
        """Read nothing from the client while received data waits for its turn."""
        self.transport.pause_reading()

    def resume_reading(self) -> None:
        """Read from the client again, unless the application has not taken the body so far."""
        if not self.flow.read_paused and self.transport.get_protocol() is self and not self.transport.is_closing():
            self.transport.resume_reading()

    def abort(self) -> None:
        """End the connection after a failure."""
        self.transport.abort()

    def on_response_complete(self) -> None:
        if self.transport.get_protocol() is not self:
            # the connection ends with this response
            return
        super().on_response_complete()
        if self.conn.their_state is h11.SEND_BODY and not self.transport.is_closing():
            self._update_timeout()

    def close_after_response(self) -> None:
        """Close the connection; if the client still sends a body, once it has had time to read the response."""
        if self.conn.their_state is not h11.SEND_BODY or self.transport.is_closing():
            self.transport.close()
            return
        # parsing the rest could cost any amount of time
        self._cancel_timeout()
        self._unparsed.clear()
        if self.transport.can_write_eof():
            self.transport.write_eof()
        LingeringClose(self.transport, self.connection_lost)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._cancel_timeout()
        self._write_deadline.stop()
        self._unparsed.clear()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Answer a request that cannot be parsed, and end the connection."""
        if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE):
            # a response has begun
            self.transport.abort()
            return
        self._cancel_timeout()
        self._unparsed.clear()
        self.transport.write(self._error_response(msg))
        if self.cycle is not None:
            # the application reads the rest of the body as a disconnect, and its response is discarded
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        LingeringClose(self.transport, self.connection_lost)

    def pause_writing(self) -> None:
        super().pause_writing()
        self._write_deadline.start()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._write_deadline.stop()

    def connection_lost(self, exc: Exception | None) -> None:
        self._cancel_timeout()
        self._write_deadline.stop()
        self._unparsed.clear()
        super().connection_lost(exc)
        # they refer to each other: without this, the body would stay until a garbage collection, which is rare
        self.cycle = None  # type: ignore[assignment]

    def handle_input(self) -> bool:
        """Parse received data for about `PARSE_TIME_S`. Return whether some of it is left."""
        if self.transport.is_closing():
            self._unparsed.clear()
            return False
        self._turn = _Turn.TAKEN
        try:
            self._parse()
        finally:
            self._turn = _Turn.AWAITED if self._unparsed else _Turn.NONE
        return bool(self._unparsed)

    def _parse(self) -> None:
        begun_at = piece_begun_at = time.perf_counter()
        # a request may have been parsed before the response to the last one
        self.handle_events()
        while self._unparsed and self.transport.get_protocol() is self:
            piece = bytes(self._unparsed[: self._parse_bytes])
            del self._unparsed[: len(piece)]
            super().data_received(piece)
            now = time.perf_counter()
            if now - piece_begun_at > PARSE_TIME_S:
                self._parse_bytes = MIN_PARSE_BYTES
            elif now - piece_begun_at < PARSE_TIME_S / 4:
                self._parse_bytes = min(2 * self._parse_bytes, MAX_PARSE_BYTES)
            piece_begun_at = now
            if now - begun_at > PARSE_TIME_S:
                break
        if self.transport.get_protocol() is self:
            self._update_timeout()

    def _error_response(self, detail: str) -> bytes:
        """Return the response to a request that cannot be parsed, as a problem document."""
        error = self.conn.error
        status = HTTPStatus(error.error_status_hint if error is not None else HTTPStatus.BAD_REQUEST)
        problem = {"type": "about:blank", "status": status, "title": status.phrase, "detail": str(error or detail)}
        body = json.dumps(problem).encode()
        headers = [("content-type", MEDIA_TYPE), ("content-length", str(len(body))), ("connection", "close")]
        events = (
            h11.Response(status_code=status, headers=headers, reason=status.phrase.encode()),
            h11.Data(data=b"" if self.conn.is_head_request else body),
            h11.EndOfMessage(),
        )
        return b"".join(self.conn.send(event) or b"" for event in events)

    def _update_timeout(self) -> None:
        """Start or cancel the timer according to the state of the HTTP connection."""
        client_state = self.conn.their_state
        if client_state is h11.IDLE or (client_state is h11.SEND_BODY and self.conn.our_state is h11.DONE):
            if self._header_timer is None and self.transport.get_protocol() is self and not self.transport.is_closing():
                self._start_timeout()
        else:
            self._cancel_timeout()

    def _start_timeout(self) -> None:
        waiting = self._load.waiting_for_head
        if len(waiting) >= MAX_WAITING_CONNECTIONS:
            oldest = next(iter(waiting))
            oldest._cancel_timeout()
            oldest.transport.abort()
        waiting[self] = None
        self._header_timer = self.loop.call_later(HEADER_TIMEOUT_S, self.transport.abort)

    def _cancel_timeout(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None
            del self._load.waiting_for_head[self]
