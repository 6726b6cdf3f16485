"""UDP sender for outputs to other tools."""

from __future__ import annotations

import asyncio
import socket
from typing import Any, Self
from urllib.parse import urlsplit

RESOLVE_TIMEOUT_S = 5.0


class AddressError(Exception):
    """Address that cannot be parsed, resolved or reached; the message says why."""


def parse_address(address: str, default_port: int | None = None) -> tuple[str, int]:
    """Return host and port of `HOST:PORT`, `[IPV6]:PORT`, or only a host if there is a default port.

    Raises `AddressError` if the address is invalid.
    """
    example = "such as 127.0.0.1:39539 or [::1]:39539"
    try:
        parts = urlsplit(f"//{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        raise AddressError(f"{address!r} is not HOST:PORT with a port of 1..65535, {example}") from None
    if not host or parts.netloc != address or parts.username is not None:
        raise AddressError(f"{address!r} is not HOST:PORT, {example}")
    if port is None and not address.endswith(":"):
        port = default_port
    if not port:
        raise AddressError(f"{address!r} has no port of 1..65535: write HOST:PORT, {example}")
    return host, port


class DatagramSender:
    """Connected UDP socket that never blocks. Use as an async context manager.

    A datagram that cannot be sent is dropped and counted, as the next frame replaces it. `host` may be a broadcast or
    multicast address. Entering raises `AddressError` if it cannot be resolved.
    """

    def __init__(self, host: str, port: int) -> None:
        self.host = host
        self.port = port
        self.sent = 0
        """Datagrams sent."""
        self.sent_bytes = 0
        self.dropped = 0
        """Datagrams that were not sent, or that the receiver's machine refused."""
        self.problem: str | None = None
        """Reason for the last dropped datagram."""
        self._socket: socket.socket | None = None

    async def __aenter__(self) -> Self:
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(RESOLVE_TIMEOUT_S):
                found = await loop.getaddrinfo(self.host, self.port, type=socket.SOCK_DGRAM)
            # many tools listen on IPv4 only
            self._socket = _connect(*min(found, key=lambda entry: entry[0] != socket.AF_INET))
        except TimeoutError:
            raise AddressError(f"{self.host} was not resolved within {RESOLVE_TIMEOUT_S:g} s") from None
        except OSError as error:
            raise AddressError(f"cannot send to {self.host}, port {self.port}: {error.strerror}") from None
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._socket is not None:
            self._socket.close()

    def send(self, datagram: bytes) -> None:
        """Send a datagram, or drop it."""
        if self._socket is None:
            raise RuntimeError("a DatagramSender sends inside `async with`")
        try:
            try:
                self._socket.send(datagram)
            except ConnectionRefusedError:
                # it reports an earlier datagram; this one was not sent yet
                self._drop(f"no program listens at {self.host}, port {self.port}")
                self._socket.send(datagram)
        except BlockingIOError:
            self._drop("the network is slower than the frames")
        except OSError as error:
            self._drop(error.strerror or str(error))
        else:
            self.sent += 1
            self.sent_bytes += len(datagram)

    def _drop(self, reason: str) -> None:
        self.dropped += 1
        self.problem = reason


def _connect(family: int, kind: int, protocol: int, _: str, address: Any) -> socket.socket:
    """Return a non-blocking socket; as it is connected, it learns that no program listens."""
    opened = socket.socket(family, kind, protocol)
    try:
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        opened.connect(address)
    except BaseException:
        opened.close()
        raise
    return opened
