"""A viewer's line: a WebSocket that comes back by itself once something was heard over it.

One that falls silent may be lost, and the system finds that out after minutes only: so another is tried beside it, and
whichever is heard first is the line from then on, as in the page.
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
"""Seconds without a word after which another line is tried: the time is asked every second."""
CONNECT_TIMEOUT_S = 3.0
"""Seconds that a try may take before it is given up for another."""
RETRY_INTERVAL_S = 0.5
"""Seconds from one try to the next."""
RETRYABLE_CLOSE_CODES = (None, 1001, 1006, 1011, 1012, 1013)
"""Close codes after which to come again may help."""


class StreamEnded(Exception):
    """The server closed the stream; the text says why."""


class ConnectionLost(StreamEnded):
    """The line broke, or the server was too busy: it may be tried again."""


class ReconnectingConnection:
    """To the WebSocket at `address()`, which is asked before each try. `opened` is called when there is a line, or
    another one, and `take` with each message; what they raise ends it. `silent` is after how many seconds without a
    word another is tried; `open_socket` makes the unconnected, non-blocking socket of a connection where the machine's
    own way is not the one meant; `headers` go with each handshake."""

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
        # the line, and its task; of the tasks that try there is one more at most
        self._connection: ClientConnection | None = None
        self._task: asyncio.Task[None] | None = None
        self._attempts: set[asyncio.Task[None]] = set()
        self._attempted_at = 0.0
        self._received_at: float | None = None
        self.reconnects = 0
        """How often it was lost, or replaced as it was silent."""
        self.close_reason = ""
        """Why the server will close it, where it has said so."""

    async def send(self, message: bytes) -> None:
        """Say something, where there is a line."""
        if self._connection is not None:
            with contextlib.suppress(ConnectionClosed):
                await self._connection.send(message)

    async def run(self) -> None:
        """Keep it up, for ever. Raises `StreamEnded` where the server ends it; and OSError, TimeoutError and
        `WebSocketException` as long as nothing was heard."""
        try:
            while True:
                if self._time_until_attempt() <= 0.0:
                    # what was tried beside a silent line was in vain
                    await self._cancel_attempts(excluded=self._task)
                    self._attempted_at = time.monotonic()
                    self._attempts.add(asyncio.create_task(self._attempt(), name="a viewer's line"))
                wait = min(self._time_until_attempt(), self._silence_timeout, 3600.0)
                done, _ = await asyncio.wait(self._attempts, timeout=wait, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    self._attempts.discard(task)
                    await self._on_attempt_ended(task)
        finally:
            await self._cancel_attempts()

    def _time_until_attempt(self) -> float:
        """Seconds until another line is to be tried."""
        if not self._attempts:
            return 0.0
        if self._received_at is None:
            return float("inf")
        return max(self._received_at + self._silence_timeout, self._attempted_at + CONNECT_TIMEOUT_S) - time.monotonic()

    async def _on_attempt_ended(self, task: asyncio.Task[None]) -> None:
        """A try has ended: raise what cannot be helped."""
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
        """One connection, until it ends or another has taken its place."""
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
                # nobody is there to answer a Close
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
            raise ConnectionLost(self.close_reason or f"the line to the server was lost ({connection.close_code})")
        why = self.close_reason or connection.close_reason
        raise StreamEnded(why or f"the server closed the stream ({connection.close_code})")

    def _make_current(self, connection: ClientConnection) -> None:
        """It is the line now: what it takes the place of ends."""
        self._connection, self._task, self.close_reason = connection, asyncio.current_task(), ""
        for other in self._attempts - {self._task}:
            other.cancel()
        self._on_open()

    async def _connect_socket(self, url: str) -> socket.socket | None:
        if self._open_socket is None:
            return None
        made, parts = self._open_socket(), urlsplit(url)
        try:
            await asyncio.get_running_loop().sock_connect(made, (parts.hostname, parts.port or 80))
        except BaseException:
            made.close()
            raise
        return made
