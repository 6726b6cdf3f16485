"""uvicorn's HTTP protocol with a timeout for request headers and for the rest of an answered request's body."""

from __future__ import annotations

import asyncio
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER_TIMEOUT_S = 10.0
"""Time for complete request headers, from the start of the connection or the first byte. Also the time for the rest of
a body after the response; closing the connection at once would discard the response."""
MAX_HEADER_BYTES = 16 << 10


class HeaderTimeoutProtocol(H11Protocol):
    """HTTP protocol that aborts a connection whose request headers are late, without a response.

    It overrides methods of the base class that uvicorn does not document; `pyproject.toml` bounds its version, and
    `tests/test_library_interfaces.py` checks them.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._header_timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._start_timeout()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._update_timeout()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if self.conn.their_state is h11.SEND_BODY:
            self._update_timeout()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._cancel_timeout()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        self._cancel_timeout()
        super().connection_lost(exc)

    def _update_timeout(self) -> None:
        """Start or cancel the timer according to the state of the HTTP connection."""
        client_state = self.conn.their_state
        if client_state is h11.IDLE or (client_state is h11.SEND_BODY and self.conn.our_state is h11.DONE):
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
