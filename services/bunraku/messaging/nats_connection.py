"""One connection to a NATS server (https://docs.nats.io/reference/reference-protocols/nats-protocol).

Implements the part of NATS core that the bus needs. The messages of one iteration of the event loop are sent together,
since each write is a record of TLS, which costs both ends more than a message; messages are delivered in order as they
are read. A connection is encrypted if the address or the server asks for it, and then never falls back to plain text.
"""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, cast

from bunraku import __version__
from bunraku.messaging.nats_address import NatsServer, TlsOptions
from bunraku.runtime.tls import create_client_context, describe_tls_error

CONNECT_TIMEOUT_S = 1.0
"""Time limit for connecting and for both handshakes, and for sending unsent data at closing, in seconds."""
HEARTBEAT_INTERVAL_S = 0.4
"""Interval between PINGs to the server, in seconds."""
MAX_MISSED_HEARTBEATS = 3
"""Number of unanswered PINGs after which the connection is closed."""
MAX_UNSENT_BYTES = 1 << 20
"""Maximum size of the send buffer, in bytes; beyond it messages are dropped."""
MAX_QUEUED_BYTES = 1 << 14
"""Size of the commands that are sent before the iteration of the event loop ends: one record of TLS."""
MAX_LINE_BYTES = 1 << 16
"""Maximum length of a control line of the protocol."""


class NatsMessage(NamedTuple):
    """A message for a subscription."""

    subscription_id: int
    subject: str
    reply: str
    """Subject for the response, empty if none is expected."""
    data: bytes
    headers: bytes
    """Raw headers, empty if there are none."""
    status: bytes
    """Empty, 500 for a failed response, or the server's 503 for a request without a responder."""


class NatsListener(Protocol):
    """Receiver of the messages of a connection."""

    def on_message(self, message: NatsMessage) -> None:
        """Process a message at once."""


class NatsConnection(asyncio.Protocol):
    """One connection to a server, open until `closed` is done; the result of `closed` is the reason."""

    def __init__(self, listener: NatsListener) -> None:
        self._listener = listener
        loop = asyncio.get_running_loop()
        self.closed: asyncio.Future[str] = loop.create_future()
        self._info_received: asyncio.Future[None] = loop.create_future()
        self._pong_received: asyncio.Future[None] = loop.create_future()
        self._transport: asyncio.Transport
        self._tcp_transport: asyncio.Transport
        self._host = ""
        self._offers_tls = False
        self._is_parsing = True
        self._heartbeat_timer: asyncio.TimerHandle | None = None
        self._missed_heartbeats = 0
        self._receive_buffer = bytearray()
        self._send_queue: list[bytes] = []
        self._queued_bytes = 0
        self._close_reason = "the server closed the connection"
        self.max_payload = 0
        self.receive_count = 0
        """Number of reads; shows whether the server has sent anything."""

    @classmethod
    async def open(cls, server: NatsServer, listener: NatsListener, initial_commands: list[bytes]) -> NatsConnection:
        """Connect and send `initial_commands`, confirmed by the server; raise OSError on failure."""
        try:
            async with asyncio.timeout(CONNECT_TIMEOUT_S):
                connection = await cls._connect(server, listener)
                try:
                    await connection._handshake(server, initial_commands)
                except BaseException:
                    connection.abort("not connected")
                    raise
                return connection
        except TimeoutError:
            raise ConnectionError("the server does not respond") from None

    @classmethod
    async def _connect(cls, server: NatsServer, listener: NatsListener) -> NatsConnection:
        loop = asyncio.get_running_loop()
        # resolved here: asyncio logs an error if a lookup inside `create_connection` fails after cancellation
        addresses = await loop.getaddrinfo(server.host, server.port, type=socket.SOCK_STREAM)
        failure = OSError("its name has no address")
        for *_, address in addresses:
            try:
                _, connection = await loop.create_connection(lambda: cls(listener), str(address[0]), server.port)
            except OSError as error:
                failure = error
            else:
                connection._host = server.host
                return connection
        raise failure

    async def _handshake(self, server: NatsServer, initial_commands: list[bytes]) -> None:
        if server.tls is not None and server.tls.handshake_first:
            await self._start_tls(server.tls)
            await self._wait_or_raise(self._info_received)
        else:
            await self._wait_or_raise(self._info_received)
            if server.tls is not None and not self._offers_tls:
                raise ConnectionError(
                    f"{server.host} does not offer TLS: add tls to the configuration of nats-server, or, if that has "
                    "handshake_first, handshake=first to the bus address"
                )
            if self._offers_tls:
                await self._start_tls(server.tls or TlsOptions())
        self._resume_parsing()
        client = {"lang": "python", "version": __version__, "name": "bunraku", "protocol": 1, "headers": True}
        modes = {"verbose": False, "pedantic": False, "no_responders": True}
        connect = json.dumps(client | modes | server.login).encode()
        self._transport.write(b"CONNECT %b\r\n%bPING\r\n" % (connect, b"".join(initial_commands)))
        await self._wait_or_raise(self._pong_received)
        self._send_heartbeat()

    async def _start_tls(self, options: TlsOptions) -> None:
        """Encrypt the connection; raise ConnectionError unless the server proves its host name."""
        context = await asyncio.to_thread(create_client_context, options.ca, options.certificate, options.key)
        if self._receive_buffer or (options.handshake_first and self._info_received.done()):
            # anybody on the path could have inserted it
            hint = "remove handshake=first from the bus address" if options.handshake_first else "it is not trusted"
            raise ConnectionError(f"{self._host} sent unencrypted data before the TLS handshake: {hint}")
        try:
            transport = await asyncio.get_running_loop().start_tls(
                self._transport, self, context, server_hostname=self._host
            )
        except OSError as error:
            raise ConnectionError(describe_tls_error(error, self._host)) from None
        if transport is None:
            raise ConnectionError(f"{self._host} closed the connection during the TLS handshake")
        self._transport = transport

    @property
    def _has_only_tls(self) -> bool:
        """True after the TLS handshake, while the server has not accepted the client."""
        return self._transport is not self._tcp_transport and not self._pong_received.done()

    async def _wait_or_raise(self, awaited: asyncio.Future[None]) -> None:
        await asyncio.wait((awaited, self.closed), return_when=asyncio.FIRST_COMPLETED)
        if self.closed.done():
            raise ConnectionError(self.closed.result())

    def send_command(self, command: bytes) -> bool:
        """Send a complete command; return False, with nothing sent, if the send buffer is full."""
        if self._transport.is_closing() or self.unsent_bytes > MAX_UNSENT_BYTES:
            return False
        if not self._send_queue:
            asyncio.get_running_loop().call_soon(self._flush)
        self._send_queue.append(command)
        self._queued_bytes += len(command)
        if self._queued_bytes >= MAX_QUEUED_BYTES:
            self._flush()
        return True

    def _flush(self) -> None:
        """Send the queued commands."""
        if self._send_queue and not self._transport.is_closing():
            self._transport.write(b"".join(self._send_queue))
        self._send_queue.clear()
        self._queued_bytes = 0

    def publish(self, subject: str, data: bytes, reply: str = "", headers: Mapping[str, str] | None = None) -> bool:
        """Send a message of at most `max_payload` bytes; return False if the send buffer is full."""
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
        """Send `reason` with status 500 instead of a response; return False if the send buffer is full."""
        head, data = b"NATS/1.0 500\r\n\r\n", reason.encode()
        sizes = len(head), len(head) + len(data)
        return self.send_command(b"HPUB %b %d %d\r\n%b%b\r\n" % (subject.encode(), *sizes, head, data))

    @property
    def unsent_bytes(self) -> int:
        """Size of the send buffer; with TLS also of its encrypted part."""
        size = self._queued_bytes + self._transport.get_write_buffer_size()
        return size if self._transport is self._tcp_transport else size + self._tcp_transport.get_write_buffer_size()

    async def close(self) -> None:
        """Close the connection; unsent data is sent if the server accepts it within `CONNECT_TIMEOUT_S`."""
        self._close_reason = "closed"
        self._flush()
        self._transport.close()
        await asyncio.wait((self.closed,), timeout=CONNECT_TIMEOUT_S)
        self.abort("closed")

    def abort(self, reason: str) -> None:
        """Close the connection at once and discard unsent data."""
        self._close_reason = reason
        # not the transport of TLS: in Python 3.11.2 that one cannot be aborted after it was closed
        self._tcp_transport.abort()
        self.connection_lost(None)

    def _send_heartbeat(self) -> None:
        if self.closed.done():
            return
        if self._missed_heartbeats >= MAX_MISSED_HEARTBEATS:
            self.abort("the server does not respond")
            return
        self._missed_heartbeats += 1
        # not limited by the send buffer: PINGs are small
        self._transport.write(b"PING\r\n")
        self._heartbeat_timer = asyncio.get_running_loop().call_later(HEARTBEAT_INTERVAL_S, self._send_heartbeat)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # cast: transports of uvloop do not inherit from asyncio.Transport
        self._transport = self._tcp_transport = cast(asyncio.Transport, transport)

    def connection_lost(self, error: Exception | None) -> None:
        if self._heartbeat_timer is not None:
            self._heartbeat_timer.cancel()
        if not self.closed.done():
            if isinstance(error, ssl.SSLError):
                # with TLS 1.3 a server rejects the certificate of a client only after the handshake
                error = ConnectionError(describe_tls_error(error, self._host))
            elif isinstance(error, ConnectionError) and self._has_only_tls:
                # a reset may overtake the alert with which the server explains it
                error = ConnectionError(f"{self._host} may ask for a certificate of this client, or not trust it")
            self.closed.set_result(f"{self._close_reason}: {error}" if error else self._close_reason)

    def data_received(self, data: bytes) -> None:
        self._missed_heartbeats = 0
        self.receive_count += 1
        self._receive_buffer += data
        self._parse_buffer()

    def _resume_parsing(self) -> None:
        """Go on after the first INFO, which decides whether the following data is encrypted."""
        self._is_parsing = True
        self._transport.resume_reading()
        self._parse_buffer()

    def _parse_buffer(self) -> None:
        start = 0
        while self._is_parsing and not self.closed.done():
            end = self._receive_buffer.find(b"\r\n", start)
            if end < 0:
                if len(self._receive_buffer) - start > MAX_LINE_BYTES:
                    self.abort("not a NATS server: a control line is too long")
                break
            try:
                next_start = self._parse_operation(bytes(self._receive_buffer[start:end]), end + 2)
            except (ValueError, IndexError, KeyError) as error:
                self.abort(f"not a NATS server: {error!r}")
                break
            if next_start is None:
                break
            start = next_start
        del self._receive_buffer[:start]

    def _parse_operation(self, line: bytes, payload_start: int) -> int | None:
        """Process a control line and its payload at `payload_start` in the buffer.

        Return the start of the next operation, None if the payload is incomplete.
        """
        operation, _, rest = line.partition(b" ")
        match operation.upper():
            case b"MSG" | b"HMSG":
                has_headers = len(operation) == 4
                words = rest.split()
                size = int(words[-1])
                if len(self._receive_buffer) < payload_start + size + 2:
                    return None
                payload = bytes(self._receive_buffer[payload_start : payload_start + size])
                header_bytes = int(words[-2]) if has_headers else 0
                # the first header line is NATS/1.0, followed by an optional status
                headers = payload[:header_bytes]
                status = headers.split(b"\r\n", 1)[0].split()[1:2]
                reply = words[2].decode() if len(words) == (5 if has_headers else 4) else ""
                self._listener.on_message(
                    NatsMessage(
                        subscription_id=int(words[1]),
                        subject=words[0].decode(),
                        reply=reply,
                        data=payload[header_bytes:],
                        headers=headers,
                        status=status[0] if status else b"",
                    )
                )
                return payload_start + size + 2
            case b"PING":
                self._transport.write(b"PONG\r\n")
            case b"PONG":
                if not self._pong_received.done():
                    self._pong_received.set_result(None)
            case b"INFO":
                info: dict[str, Any] = json.loads(rest)
                self.max_payload = int(info["max_payload"])
                if not self._info_received.done():
                    self._offers_tls = bool(info.get("tls_required") or info.get("tls_available"))
                    self._is_parsing = False
                    self._transport.pause_reading()
                    self._info_received.set_result(None)
            case b"-ERR":
                # after a fatal error the server closes the connection
                self._close_reason = f"the server reports {rest.decode(errors='replace')}"
            case b"+OK":
                pass
            case _:
                raise ValueError(line[:40])
        return payload_start
