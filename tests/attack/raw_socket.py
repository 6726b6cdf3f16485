"""Socket of a hostile client: sends any bytes, reads only on request, and reports how the server reacts."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Self

from tests.attack.registry import Target
from tests.credentials import bearer_headers
from tests.raw_client import upgrade_request

MASK = b"\x37\xfa\x21\x3d"
"""Masking key of all frames, that of the examples in RFC 6455, section 5.7."""
CLOSED = "closed without an answer"
OPEN = "still open"
MAX_KEPT_MESSAGES = 64
MAX_RESPONSE_BYTES = 32 << 20
ANSWER_TIMEOUT_S = 10.0
"""Time for an answer that the server owes at once, seconds: long enough for a busy machine."""


@dataclass(frozen=True)
class Response:
    """Response to a request."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    def json(self) -> Any:
        """Return the parsed body."""
        return json.loads(self.body)


class RawSocket:
    """Non-blocking TCP connection to the target. Sending to a closed connection returns False instead of raising."""

    def __init__(self, connected: socket.socket) -> None:
        self._socket = connected
        self._loop = asyncio.get_running_loop()
        self._received = bytearray()
        self.messages: deque[bytes] = deque(maxlen=MAX_KEPT_MESSAGES)
        """Newest binary messages among the frames read so far."""
        self.is_closed = False
        """True once the server has closed the connection, or has reset it."""

    @classmethod
    async def connect(
        cls, target: Target, *, receive_buffer_bytes: int | None = None, address: int | None = None
    ) -> Self:
        """Connect to the target. `receive_buffer_bytes` is SO_RCVBUF, `address` the last byte of the source address.

        Raises OSError.
        """
        connecting = socket.socket()
        try:
            connecting.setblocking(False)
            connecting.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if receive_buffer_bytes is not None:
                connecting.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
            if target.source:
                connecting.bind((f"{target.source}.{address or 1}", 0))
            async with asyncio.timeout(10.0):
                await asyncio.get_running_loop().sock_connect(connecting, (target.host, target.port))
        except BaseException:
            connecting.close()
            raise
        return cls(connecting)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def end_sending(self) -> None:
        """Close the sending direction only."""
        self._socket.shutdown(socket.SHUT_WR)

    def reset(self) -> None:
        """Close the connection with RST."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        self._socket.close()

    async def send(self, data: bytes, timeout_s: float = ANSWER_TIMEOUT_S) -> bool:
        """Send bytes. Return False if the connection is closed, or if they are not accepted within the timeout."""
        if self.is_closed:
            return False
        try:
            async with asyncio.timeout(timeout_s):
                await self._loop.sock_sendall(self._socket, data)
        except TimeoutError:
            return False
        except OSError:
            self.is_closed = True
            return False
        return True

    async def receive(self, timeout_s: float = ANSWER_TIMEOUT_S, count: int = 65_536) -> bytes:
        """Return the next bytes, none if the connection is closed or nothing arrives in time."""
        try:
            async with asyncio.timeout(timeout_s):
                data = await self._loop.sock_recv(self._socket, count)
        except TimeoutError:
            return b""
        except OSError:
            data = b""
        self.is_closed = self.is_closed or not data
        return data

    async def read_response(
        self, timeout_s: float = ANSWER_TIMEOUT_S, max_bytes: int = MAX_RESPONSE_BYTES
    ) -> Response | None:
        """Return the next response, interim ones skipped; None without a complete header within the timeout."""
        until = time.monotonic() + timeout_s
        while (end := self._received.find(b"\r\n\r\n")) < 0:
            if not await self._receive_more(until):
                return None
        head = bytes(self._received[:end]).decode("latin-1").split("\r\n")
        del self._received[: end + 4]
        if (found := re.match(r"HTTP/1\.[01] (\d{3})", head[0])) is None:
            return None
        status = int(found[1])
        if status == 100:
            return await self.read_response(until - time.monotonic(), max_bytes)
        pairs = (line.partition(":") for line in head[1:])
        headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
        size = int(headers.get("content-length", "0"))
        while len(self._received) < min(size, max_bytes) and status >= 200:
            if not await self._receive_more(until):
                break
        body = bytes(self._received[:size])
        del self._received[:size]
        return Response(status, headers, body)

    async def describe_reaction(self, timeout_s: float = 3.0) -> str:
        """Return the status of the response, and whether the connection stays open, as text."""
        response = await self.read_response(timeout_s)
        if response is None:
            return CLOSED if self.is_closed else OPEN
        return str(response.status)

    async def read_close_code(self, timeout_s: float = ANSWER_TIMEOUT_S) -> int | None:
        """Read frames of the server until a Close frame and return its code; None without one.

        1005 stands for a Close frame without a code (RFC 6455, section 7.1.5).
        """
        until = time.monotonic() + timeout_s
        while True:
            code = self._take_close_code()
            if code is not None or not await self._receive_more(until):
                return code

    async def wait_until_closed(self, timeout_s: float) -> bool:
        """Read and discard until the server closes the connection. Return False if it stays open."""
        until = time.monotonic() + timeout_s
        while not self.is_closed and (left := until - time.monotonic()) > 0:
            await self.receive(left)
        return self.is_closed

    async def is_aborted(self, probe: bytes = b"x") -> bool:
        """Return whether the server has closed the connection, without reading from it."""
        try:
            # an orderly close is not visible without reading, but a second write to it fails
            for _ in range(2):
                self._socket.send(probe)
                await asyncio.sleep(0.05)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return False

    async def _receive_more(self, until: float) -> bool:
        if self.is_closed or (left := until - time.monotonic()) <= 0:
            return False
        data = await self.receive(left)
        self._received += data
        return bool(data)

    def _take_close_code(self) -> int | None:
        """Discard the received frames up to a Close frame and return its code."""
        at, data, code = 0, self._received, None
        while code is None and len(data) - at >= 2:
            opcode, size, body = data[at] & 15, data[at + 1] & 127, at + 2
            if size > 125:
                extended = 2 if size == 126 else 8
                size, body = int.from_bytes(data[body : body + extended], "big"), body + extended
            if len(data) < body + size:
                break
            at = body + size
            if opcode == 2:
                self.messages.append(bytes(data[body:at]))
            if opcode == 8:
                code = int.from_bytes(data[body : body + 2], "big") if size >= 2 else 1005
        del data[:at]
        return code


@asynccontextmanager
async def open_socket(
    target: Target, *, receive_buffer_bytes: int | None = None, address: int | None = None
) -> AsyncIterator[RawSocket]:
    """Connect to the target for the length of a block; the parameters are those of `RawSocket.connect`."""
    opened = await RawSocket.connect(target, receive_buffer_bytes=receive_buffer_bytes, address=address)
    try:
        yield opened
    finally:
        opened.close()


def frame(opcode: int, payload: bytes = b"", *, final: bool = True) -> bytes:
    """Return a masked frame (RFC 6455, section 5.2)."""
    size = len(payload)
    if size < 126:
        head = bytes((opcode | 0x80 * final, 0x80 | size))
    elif size < 1 << 16:
        head = bytes((opcode | 0x80 * final, 0xFE)) + size.to_bytes(2, "big")
    else:
        head = bytes((opcode | 0x80 * final, 0xFF)) + size.to_bytes(8, "big")
    return head + MASK + bytes(byte ^ MASK[at & 3] for at, byte in enumerate(payload))


def handshake(target: Target, path: str, token: str | None = None, *lines: str) -> bytes:
    """Return the upgrade request for a path, with a token and further header lines."""
    request = upgrade_request(f"ws://{target.host}:{target.port}{path}")
    options = [*(f"{name}: {value}" for name, value in bearer_headers(token).items()), *lines]
    return request.removesuffix(b"\r\n") + "".join(f"{line}\r\n" for line in options).encode("latin-1") + b"\r\n"


def request(
    target: Target, method: str, path: str, *lines: str, token: str | None = None, body: bytes | None = None
) -> bytes:
    """Return a request with a token, further header lines and a body."""
    options = [*(f"{name}: {value}" for name, value in bearer_headers(token).items()), *lines]
    if body is not None:
        options.append(f"Content-Length: {len(body)}")
    head = "\r\n".join([f"{method} {path} HTTP/1.1", f"Host: {target.host}:{target.port}", *options, "", ""])
    return head.encode("latin-1") + (body or b"")


async def fetch(
    target: Target,
    method: str,
    path: str,
    *lines: str,
    token: str | None = None,
    body: bytes | None = None,
    address: int | None = None,
    timeout_s: float = 20.0,
) -> Response | None:
    """Send one request on its own connection and return the response, None without one."""
    try:
        async with open_socket(target, address=address) as opened:
            # a server may answer and close before it has read the whole body
            sending = asyncio.create_task(
                opened.send(request(target, method, path, *lines, token=token, body=body), timeout_s)
            )
            try:
                # the response to HEAD announces a body that does not follow
                return await opened.read_response(timeout_s, 0 if method == "HEAD" else MAX_RESPONSE_BYTES)
            finally:
                sending.cancel()
                await asyncio.gather(sending, return_exceptions=True)
    except (OSError, TimeoutError):
        return None


async def fetch_json(target: Target, method: str, path: str, content: Any, **options: Any) -> Response | None:
    """Send a JSON body; see `fetch`."""
    body = json.dumps(content).encode()
    return await fetch(target, method, path, "Content-Type: application/json", body=body, **options)


async def connect_websocket(
    target: Target,
    path: str,
    token: str | None = None,
    *,
    receive_buffer_bytes: int | None = None,
    address: int | None = None,
) -> RawSocket | None:
    """Open a WebSocket; None if the server rejects it."""
    opened = await RawSocket.connect(target, receive_buffer_bytes=receive_buffer_bytes, address=address)
    await opened.send(handshake(target, path, token))
    response = await opened.read_response()
    if response is None or response.status != 101:
        opened.close()
        return None
    return opened
