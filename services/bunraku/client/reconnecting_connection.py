"""WebSocket connection that re-establishes itself after its first message.

A silent connection may be lost, which the operating system detects only after minutes. A second connection is therefore
attempted beside it, and whichever receives a message first becomes current, as in the page.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable, Mapping
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException

from bunraku.wire.messages import MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL

SILENCE_TIMEOUT_S = 4.0
"""Silence after which another connection is attempted; clock pings are sent every second."""
CONNECT_TIMEOUT_S = 3.0
"""Time after which an attempt is replaced by another."""
RETRY_INTERVAL_S = 0.5
"""Interval between attempts."""
RETRYABLE_CLOSE_CODES = (None, 1001, 1006, 1011, 1012, 1013)
"""Close codes after which reconnecting may succeed."""


class StreamEnded(Exception):
    """Stream closed by the server; the message has the reason."""


class ConnectionLost(StreamEnded):
    """Connection lost, or server overloaded: a retry may succeed."""


class ReconnectingConnection:
    """Connection to the WebSocket at `make_url()`, which is called before each attempt.

    `on_open` is called for every new current connection, `on_message` for each message; their exceptions end `run`.
    `open_socket` creates the unconnected, non-blocking socket of a connection if the default route is not wanted;
    `headers` are sent with each handshake.
    """

    def __init__(
        self,
        make_url: Callable[[], str],
        on_open: Callable[[], None],
        on_message: Callable[[bytes], None],
        *,
        silence_timeout: float = SILENCE_TIMEOUT_S,
        open_socket: Callable[[], socket.socket] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        self._make_url = make_url
        self._on_open = on_open
        self._on_message = on_message
        self._silence_timeout = silence_timeout
        self._open_socket = open_socket
        self._headers = headers
        # current connection and its task; there is at most one more attempt
        self._connection: ClientConnection | None = None
        self._task: asyncio.Task[None] | None = None
        self._attempts: set[asyncio.Task[None]] = set()
        self._attempted_at = 0.0
        self._received_at: float | None = None
        self.reconnects = 0
        """Connections lost, or replaced because of silence."""
        self.close_reason = ""
        """Reason for the close that the server announced."""

    @property
    def is_connected(self) -> bool:
        """True while there is a connection, which may be lost without notice."""
        return self._connection is not None

    async def send(self, message: bytes) -> None:
        """Send a message if connected."""
        if self._connection is not None:
            with contextlib.suppress(ConnectionClosed):
                await self._connection.send(message)

    async def run(self) -> None:
        """Keep the connection up until it ends.

        Raises `StreamEnded` if the server ends the stream, and OSError, TimeoutError or `WebSocketException` as long as
        no message was received.
        """
        try:
            while True:
                if self._time_until_attempt() <= 0.0:
                    # the attempt beside a silent connection failed
                    await self._cancel_attempts(excluded=self._task)
                    self._attempted_at = time.monotonic()
                    self._attempts.add(asyncio.create_task(self._attempt(), name="viewer connection"))
                wait = min(self._time_until_attempt(), self._silence_timeout, 3600.0)
                done, _ = await asyncio.wait(self._attempts, timeout=wait, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    self._attempts.discard(task)
                    await self._on_attempt_ended(task)
        finally:
            await self._cancel_attempts()

    def _time_until_attempt(self) -> float:
        """Return the seconds until the next attempt."""
        if not self._attempts:
            return 0.0
        if self._received_at is None:
            return float("inf")
        return max(self._received_at + self._silence_timeout, self._attempted_at + CONNECT_TIMEOUT_S) - time.monotonic()

    async def _on_attempt_ended(self, task: asyncio.Task[None]) -> None:
        """Handle the end of an attempt; raise errors that a retry cannot solve."""
        if task.cancelled():
            return
        if task is self._task:
            self._task = self._connection = None
        error = task.exception()
        assert error is not None
        if self._received_at is None or not isinstance(
            error, (ConnectionLost, OSError, TimeoutError, WebSocketException)
        ):
            raise error
        if not self._attempts:
            self.reconnects += 1
            await asyncio.sleep(RETRY_INTERVAL_S)

    async def _cancel_attempts(self, excluded: asyncio.Task[None] | None = None) -> None:
        ended = [task for task in self._attempts if task is not excluded]
        for task in ended:
            task.cancel()
        await asyncio.gather(*ended, return_exceptions=True)
        self._attempts.difference_update(ended)

    async def _attempt(self) -> None:
        """Run one connection until it ends or another replaces it."""
        address = self._make_url()
        async with connect(
            address,
            sock=await self._connect_socket(address),
            subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
            additional_headers=self._headers,
            compression=None,
            max_size=MAX_SERVER_MESSAGE_BYTES,
            open_timeout=10,
            close_timeout=0.5,
            ping_interval=None,
        ) as connection:
            try:
                await self._receive(connection)
            except asyncio.CancelledError:
                # the server does not answer a close frame on a lost connection
                connection.transport.abort()
                raise

    async def _receive(self, connection: ClientConnection) -> None:
        if self._connection is None:
            self._make_current(connection)
        with contextlib.suppress(ConnectionClosed):
            async for data in connection:
                if connection is not self._connection:
                    self.reconnects += 1
                    self._make_current(connection)
                self._received_at = time.monotonic()
                for other in self._attempts - {self._task}:
                    other.cancel()
                if isinstance(data, bytes):
                    self._on_message(data)
        if connection.close_code in RETRYABLE_CLOSE_CODES:
            raise ConnectionLost(
                self.close_reason or f"the connection to the server was lost ({connection.close_code})"
            )
        reason = self.close_reason or connection.close_reason
        raise StreamEnded(reason or f"the server closed the stream ({connection.close_code})")

    def _make_current(self, connection: ClientConnection) -> None:
        """Make this the current connection and cancel the others."""
        self._connection, self._task, self.close_reason = connection, asyncio.current_task(), ""
        for other in self._attempts - {self._task}:
            other.cancel()
        self._on_open()

    async def _connect_socket(self, url: str) -> socket.socket | None:
        if self._open_socket is None:
            return None
        connecting, parts = self._open_socket(), urlsplit(url)
        try:
            await asyncio.get_running_loop().sock_connect(connecting, (parts.hostname, parts.port or 80))
        except BaseException:
            connecting.close()
            raise
        return connecting
