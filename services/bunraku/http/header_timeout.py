"""uvicorn's HTTP protocol, which waits no longer than it should for the head of a request, nor for the rest of a body
that was answered before it had come."""

from __future__ import annotations

import asyncio
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER_TIMEOUT_S = 10.0
"""In which the head of a request comes whole, from its connection or its first byte on; and what is left of a body,
from the answer on: to end a connection at once would take the answer back."""
MAX_HEADER_BYTES = 16 << 10


class HeaderTimeoutProtocol(H11Protocol):
    """The protocol; a connection whose head is late is ended with nothing said, as nothing was asked."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._header_timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """As asyncio has it."""
        super().connection_made(transport)
        self._start_timeout()

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        super().data_received(data)
        self._update_timeout()

    def on_response_complete(self) -> None:
        """As the base has it."""
        super().on_response_complete()
        if self.conn.their_state is h11.SEND_BODY:
            self._update_timeout()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """As the base has it: from here on this is no HTTP."""
        self._cancel_timeout()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """As asyncio has it."""
        self._cancel_timeout()
        super().connection_lost(exc)

    def _update_timeout(self) -> None:
        """Wait, or no longer, as the connection now stands."""
        theirs = self.conn.their_state
        if theirs is h11.IDLE or (theirs is h11.SEND_BODY and self.conn.our_state is h11.DONE):
            if self._header_timer is None and self.transport.get_protocol() is self and not self.transport.is_closing():
                self._start_timeout()
        else:
            self._cancel_timeout()

    def _start_timeout(self) -> None:
        self._header_timer = self.loop.call_later(HEADER_TIMEOUT_S, self.transport.abort)

    def _cancel_timeout(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None
