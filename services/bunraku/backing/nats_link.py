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

CONNECTING = 1.0
"""Seconds that a server has to accept a connection and to speak, and to take what is left when it is closed."""
BEAT = 0.4
"""Seconds between two signs of life that the server is asked for."""
BEATS = 3
"""So many that stay unanswered end the connection."""
WAITING = 1 << 20
"""Bytes that may wait to be taken by the server; while more do, what is said is lost."""
LONGEST_LINE = 1 << 16


@dataclass(frozen=True, slots=True)
class Server:
    """Where a server is, and who we are to it: `login` has the fields of CONNECT that say so."""

    host: str
    port: int
    login: dict[str, str]


def read_servers(url: str) -> list[Server]:
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
        servers.append(Server(str(parts.hostname), parts.port or 4222, login))
    return servers


class Listener(Protocol):
    """Who a connection belongs to."""

    def hear(self, number: int, subject: str, reply: str, data: bytes, head: bytes, status: bytes) -> None:
        """A message to subscription `number`; `head` are its headers as they came, empty where it has none; `status` is
        empty, 500 where an answer failed, or the server's own 503 where nobody listens."""


class Link(asyncio.Protocol):
    """One connection, open until `ended` is done; its result says why it ended."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        loop = asyncio.get_running_loop()
        self.ended: asyncio.Future[str] = loop.create_future()
        self._told: asyncio.Future[None] = loop.create_future()
        self._answered: asyncio.Future[None] = loop.create_future()
        self._transport: asyncio.Transport
        self._beating: asyncio.TimerHandle | None = None
        self._unanswered = 0
        self._unread = bytearray()
        self._why = "the server has ended the connection"
        self.max_payload = 0
        self.heard = 0
        """How often anything came."""

    @classmethod
    async def open(cls, server: Server, listener: Listener, first: list[bytes]) -> Link:
        """Connect, with the commands `first` said and taken; raises OSError where that does not succeed."""
        try:
            async with asyncio.timeout(CONNECTING):
                link = await cls._connect(server, listener)
                try:
                    await link._greet(server, first)
                except BaseException:
                    link.abort("not connected")
                    raise
                return link
        except TimeoutError:
            raise ConnectionError("the server does not answer") from None

    @classmethod
    async def _connect(cls, server: Server, listener: Listener) -> Link:
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

    async def _greet(self, server: Server, first: list[bytes]) -> None:
        await self._or_end(self._told)
        about = {"lang": "python", "version": __version__, "name": "bunraku", "protocol": 1, "headers": True}
        modes = {"verbose": False, "pedantic": False, "no_responders": True}
        connect = json.dumps(about | modes | server.login).encode()
        self._transport.write(b"CONNECT %b\r\n%bPING\r\n" % (connect, b"".join(first)))
        await self._or_end(self._answered)
        self._beat()

    async def _or_end(self, awaited: asyncio.Future[None]) -> None:
        await asyncio.wait((awaited, self.ended), return_when=asyncio.FIRST_COMPLETED)
        if self.ended.done():
            raise ConnectionError(self.ended.result())

    def say(self, command: bytes) -> bool:
        """Say a whole command; whether there was room for it."""
        if self._transport.is_closing() or self.waiting > WAITING:
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
            return self.say(b"HPUB %b %b %b\r\n%b%b\r\n" % (subject.encode(), reply.encode(), sizes, head, data))
        return self.say(b"PUB %b %b %d\r\n%b\r\n" % (subject.encode(), reply.encode(), len(data), data))

    def fail(self, subject: str, why: str) -> bool:
        """Send `why` under the status 500, in place of an answer; whether there was room for it."""
        head, data = b"NATS/1.0 500\r\n\r\n", why.encode()
        sizes = len(head), len(head) + len(data)
        return self.say(b"HPUB %b %d %d\r\n%b%b\r\n" % (subject.encode(), *sizes, head, data))

    @property
    def waiting(self) -> int:
        """Bytes that wait to be taken by the server."""
        return self._transport.get_write_buffer_size()

    async def close(self) -> None:
        """End it; what waits is sent if that takes no longer than a second."""
        self._why = "closed"
        self._transport.close()
        await asyncio.wait((self.ended,), timeout=CONNECTING)
        self.abort("closed")

    def abort(self, why: str) -> None:
        """End it at once."""
        self._why = why
        self._transport.abort()
        self.connection_lost(None)

    def _beat(self) -> None:
        if self.ended.done():
            return
        if self._unanswered >= BEATS:
            self.abort("the server is silent")
            return
        self._unanswered += 1
        # past the limit of what may wait: there is little of it
        self._transport.write(b"PING\r\n")
        self._beating = asyncio.get_running_loop().call_later(BEAT, self._beat)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """As asyncio has it."""
        # uvloop's are none in name
        self._transport = cast(asyncio.Transport, transport)

    def connection_lost(self, error: Exception | None) -> None:
        """As asyncio has it."""
        if self._beating is not None:
            self._beating.cancel()
        if not self.ended.done():
            self.ended.set_result(f"{self._why}: {error}" if error else self._why)

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        self._unanswered = 0
        self.heard += 1
        self._unread += data
        start = 0
        while not self.ended.done():
            end = self._unread.find(b"\r\n", start)
            if end < 0:
                if len(self._unread) - start > LONGEST_LINE:
                    self.abort("the server speaks something else")
                break
            try:
                after = self._read(bytes(self._unread[start:end]), end + 2)
            except (ValueError, IndexError, KeyError) as error:
                self.abort(f"the server speaks something else: {error!r}")
                break
            if after is None:
                break
            start = after
        del self._unread[:start]

    def _read(self, line: bytes, at: int) -> int | None:
        """Take a line in, whose payload would begin `at`; where the next begins, None where the payload is not all
        there."""
        operation, _, rest = line.partition(b" ")
        match operation.upper():
            case b"MSG" | b"HMSG":
                headed = len(operation) == 4
                words = rest.split()
                size = int(words[-1])
                if len(self._unread) < at + size + 2:
                    return None
                payload = bytes(self._unread[at : at + size])
                header = int(words[-2]) if headed else 0
                # the first line is NATS/1.0, then the status, where there is one
                head = payload[:header]
                status = head.split(b"\r\n", 1)[0].split()[1:2]
                reply = words[2].decode() if len(words) == (5 if headed else 4) else ""
                number, subject = int(words[1]), words[0].decode()
                self._listener.hear(number, subject, reply, payload[header:], head, status[0] if status else b"")
                return at + size + 2
            case b"PING":
                self._transport.write(b"PONG\r\n")
            case b"PONG":
                if not self._answered.done():
                    self._answered.set_result(None)
            case b"INFO":
                told: dict[str, Any] = json.loads(rest)
                self.max_payload = int(told["max_payload"])
                if told.get("tls_required"):
                    self.abort("the server wants TLS, which is not spoken here")
                elif not self._told.done():
                    self._told.set_result(None)
            case b"-ERR":
                # where it is grave, the server ends the connection after it
                self._why = f"the server says {rest.decode(errors='replace')}"
            case b"+OK":
                pass
            case _:
                raise ValueError(line[:40])
        return at
