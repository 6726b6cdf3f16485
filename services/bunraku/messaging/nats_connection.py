"""One connection to a NATS server (https://docs.nats.io/reference/reference-protocols/nats-protocol).

Only what the bus needs of NATS core: what is written leaves at once, what comes is handed on as it is read, in order.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast
from urllib.parse import unquote, urlsplit

from bunraku import __version__

CONNECT_TIMEOUT_S = 1.0
"""Seconds that a server has to accept a connection and to speak, and to take what is left when it is closed."""
HEARTBEAT_INTERVAL_S = 0.4
"""Seconds between two signs of life that the server is asked for."""
MAX_MISSED_HEARTBEATS = 3
"""So many that stay unanswered end the connection."""
MAX_UNSENT_BYTES = 1 << 20
"""Bytes that may wait to be taken by the server; while more do, what is said is lost."""
MAX_LINE_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class NatsServer:
    """Where a server is, and who we are to it: `login` has the fields of CONNECT that say so."""

    host: str
    port: int
    login: dict[str, str]


def parse_servers(url: str) -> list[NatsServer]:
    """The servers of `nats://one:4222,user:password@two:4222`; raises ValueError where it is no such address."""
    scheme, _, rest = url.partition("://")
    servers = []
    for part in rest.split(","):
        try:
            parts = urlsplit(f"nats://{part.removeprefix('nats://')}")
            # reading the port looks at it
            fine = scheme == "nats" and parts.hostname and parts.port != 0 and parts.path in ("", "/")
        except ValueError:
            fine = False
        if not fine:
            # not the address itself, which may have a password
            raise ValueError("a bus is at memory: or nats://host:port, more servers after commas")
        login = {}
        if parts.username and parts.password is None:
            login = {"auth_token": unquote(parts.username)}
        elif parts.username:
            login = {"user": unquote(parts.username), "pass": unquote(parts.password or "")}
        servers.append(NatsServer(str(parts.hostname), parts.port or 4222, login))
    return servers


class NatsListener(Protocol):
    """Who a connection belongs to."""

    def on_message(
        self, subscription_id: int, subject: str, reply: str, data: bytes, headers: bytes, status: bytes
    ) -> None:
        """A message to subscription `number`; `head` are its headers as they came, empty where it has none; `status` is
        empty, 500 where an answer failed, or the server's own 503 where nobody listens."""


class NatsConnection(asyncio.Protocol):
    """One connection, open until `ended` is done; its result says why it ended."""

    def __init__(self, listener: NatsListener) -> None:
        self._listener = listener
        loop = asyncio.get_running_loop()
        self.closed: asyncio.Future[str] = loop.create_future()
        self._info_received: asyncio.Future[None] = loop.create_future()
        self._pong_received: asyncio.Future[None] = loop.create_future()
        self._transport: asyncio.Transport
        self._heartbeat_timer: asyncio.TimerHandle | None = None
        self._missed_heartbeats = 0
        self._receive_buffer = bytearray()
        self._close_reason = "the server has ended the connection"
        self.max_payload = 0
        self.receive_count = 0
        """How often anything came."""

    @classmethod
    async def open(cls, server: NatsServer, listener: NatsListener, initial_commands: list[bytes]) -> NatsConnection:
        """Connect, with the commands `first` said and taken; raises OSError where that does not succeed."""
        try:
            async with asyncio.timeout(CONNECT_TIMEOUT_S):
                link = await cls._connect(server, listener)
                try:
                    await link._handshake(server, initial_commands)
                except BaseException:
                    link.abort("not connected")
                    raise
                return link
        except TimeoutError:
            raise ConnectionError("the server does not answer") from None

    @classmethod
    async def _connect(cls, server: NatsServer, listener: NatsListener) -> NatsConnection:
        loop = asyncio.get_running_loop()
        # looked up here: within `create_connection` one that fails when nobody waits any more is logged as a fault
        found = await loop.getaddrinfo(server.host, server.port, type=socket.SOCK_STREAM)
        refused = OSError("its name has no address")
        for *_, address in found:
            try:
                _, link = await loop.create_connection(lambda: cls(listener), str(address[0]), server.port)
            except OSError as error:
                refused = error
            else:
                return link
        raise refused

    async def _handshake(self, server: NatsServer, initial_commands: list[bytes]) -> None:
        await self._wait_or_raise(self._info_received)
        about = {"lang": "python", "version": __version__, "name": "bunraku", "protocol": 1, "headers": True}
        modes = {"verbose": False, "pedantic": False, "no_responders": True}
        connect = json.dumps(about | modes | server.login).encode()
        self._transport.write(b"CONNECT %b\r\n%bPING\r\n" % (connect, b"".join(initial_commands)))
        await self._wait_or_raise(self._pong_received)
        self._send_heartbeat()

    async def _wait_or_raise(self, awaited: asyncio.Future[None]) -> None:
        await asyncio.wait((awaited, self.closed), return_when=asyncio.FIRST_COMPLETED)
        if self.closed.done():
            raise ConnectionError(self.closed.result())

    def send_command(self, command: bytes) -> bool:
        """Say a whole command; whether there was room for it."""
        if self._transport.is_closing() or self.unsent_bytes > MAX_UNSENT_BYTES:
            return False
        self._transport.write(command)
        return True

    def publish(self, subject: str, data: bytes, reply: str = "", headers: Mapping[str, str] | None = None) -> bool:
        """Send a message of at most `max_payload` bytes; whether there was room for it."""
        if headers:
            head = "".join(
                ["NATS/1.0\r\n", *(f"{name}: {value}\r\n" for name, value in headers.items()), "\r\n"]
            ).encode()
            sizes = b"%d %d" % (len(head), len(head) + len(data))
            return self.send_command(
                b"HPUB %b %b %b\r\n%b%b\r\n" % (subject.encode(), reply.encode(), sizes, head, data)
            )
        return self.send_command(b"PUB %b %b %d\r\n%b\r\n" % (subject.encode(), reply.encode(), len(data), data))

    def respond_error(self, subject: str, reason: str) -> bool:
        """Send `why` under the status 500, in place of an answer; whether there was room for it."""
        head, data = b"NATS/1.0 500\r\n\r\n", reason.encode()
        sizes = len(head), len(head) + len(data)
        return self.send_command(b"HPUB %b %d %d\r\n%b%b\r\n" % (subject.encode(), *sizes, head, data))

    @property
    def unsent_bytes(self) -> int:
        """Bytes that wait to be taken by the server."""
        return self._transport.get_write_buffer_size()

    async def close(self) -> None:
        """End it; what waits is sent if that takes no longer than a second."""
        self._close_reason = "closed"
        self._transport.close()
        await asyncio.wait((self.closed,), timeout=CONNECT_TIMEOUT_S)
        self.abort("closed")

    def abort(self, reason: str) -> None:
        """End it at once."""
        self._close_reason = reason
        self._transport.abort()
        self.connection_lost(None)

    def _send_heartbeat(self) -> None:
        if self.closed.done():
            return
        if self._missed_heartbeats >= MAX_MISSED_HEARTBEATS:
            self.abort("the server is silent")
            return
        self._missed_heartbeats += 1
        # past the limit of what may wait: there is little of it
        self._transport.write(b"PING\r\n")
        self._heartbeat_timer = asyncio.get_running_loop().call_later(HEARTBEAT_INTERVAL_S, self._send_heartbeat)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """As asyncio has it."""
        # uvloop's are none in name
        self._transport = cast(asyncio.Transport, transport)

    def connection_lost(self, error: Exception | None) -> None:
        """As asyncio has it."""
        if self._heartbeat_timer is not None:
            self._heartbeat_timer.cancel()
        if not self.closed.done():
            self.closed.set_result(f"{self._close_reason}: {error}" if error else self._close_reason)

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        self._missed_heartbeats = 0
        self.receive_count += 1
        self._receive_buffer += data
        start = 0
        while not self.closed.done():
            end = self._receive_buffer.find(b"\r\n", start)
            if end < 0:
                if len(self._receive_buffer) - start > MAX_LINE_BYTES:
                    self.abort("the server speaks something else")
                break
            try:
                after = self._parse_operation(bytes(self._receive_buffer[start:end]), end + 2)
            except (ValueError, IndexError, KeyError) as error:
                self.abort(f"the server speaks something else: {error!r}")
                break
            if after is None:
                break
            start = after
        del self._receive_buffer[:start]

    def _parse_operation(self, line: bytes, payload_start: int) -> int | None:
        """Take a line in, whose payload would begin `at`; where the next begins, None where the payload is not all
        there."""
        operation, _, rest = line.partition(b" ")
        match operation.upper():
            case b"MSG" | b"HMSG":
                headed = len(operation) == 4
                words = rest.split()
                size = int(words[-1])
                if len(self._receive_buffer) < payload_start + size + 2:
                    return None
                payload = bytes(self._receive_buffer[payload_start : payload_start + size])
                header = int(words[-2]) if headed else 0
                # the first line is NATS/1.0, then the status, where there is one
                head = payload[:header]
                status = head.split(b"\r\n", 1)[0].split()[1:2]
                reply = words[2].decode() if len(words) == (5 if headed else 4) else ""
                number, subject = int(words[1]), words[0].decode()
                self._listener.on_message(number, subject, reply, payload[header:], head, status[0] if status else b"")
                return payload_start + size + 2
            case b"PING":
                self._transport.write(b"PONG\r\n")
            case b"PONG":
                if not self._pong_received.done():
                    self._pong_received.set_result(None)
            case b"INFO":
                told: dict[str, Any] = json.loads(rest)
                self.max_payload = int(told["max_payload"])
                if told.get("tls_required"):
                    self.abort("the server wants TLS, which is not spoken here")
                elif not self._info_received.done():
                    self._info_received.set_result(None)
            case b"-ERR":
                # where it is grave, the server ends the connection after it
                self._close_reason = f"the server says {rest.decode(errors='replace')}"
            case b"+OK":
                pass
            case _:
                raise ValueError(line[:40])
        return payload_start
