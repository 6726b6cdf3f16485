"""Simulated WebSocket of a viewer: the server's side is the transport of a real `WebSocketConnection`."""

from __future__ import annotations

import asyncio
import struct
from collections import deque
from collections.abc import Callable
from functools import partial
from random import Random
from typing import Any

from bunraku.websocket.frame import Opcode
from bunraku.websocket.link import LinkSample
from tests.simulation.link import Link, LinkQuality
from tests.simulation.node import Node

KERNEL_BUFFER_BYTES = 64 << 10
"""Bytes on the way; the process keeps further ones, and the connection is then not writable."""


class ServerTransport(asyncio.Transport):
    """Server's side of a connection between two processes, and the measurements of its link."""

    def __init__(self, server: Node, client: Node, random: Random, quality: LinkQuality) -> None:
        super().__init__()
        self.downlink = Link(client, random, quality)
        self.uplink = Link(server, random, quality)
        self.on_data: Callable[[bytes], None] = lambda _: None
        """Function of the client that receives what arrives."""
        self.on_lost: Callable[[], None] = lambda: None
        """Function of the client that is called when the connection ends."""
        self.random = random
        self._server = server
        self._client = client
        self._protocol: Any = None
        self._unsent: deque[bytes] = deque()
        self._in_flight = 0
        self._written = 0
        self._is_paused = False
        self._is_closing = self._is_lost = False
        self._reads = True
        self._unread: deque[bytes] = deque()
        server.on_kill.append(self._on_server_killed)
        client.on_kill.append(self._on_client_killed)

    # transport

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self._protocol = protocol

    def get_protocol(self) -> asyncio.BaseProtocol:
        protocol: asyncio.BaseProtocol = self._protocol
        return protocol

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        assert (high, low) == (0, 0)

    def get_write_buffer_size(self) -> int:
        return sum(map(len, self._unsent))

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return ("192.0.2.1", 1) if name == "peername" else default

    def is_closing(self) -> bool:
        return self._is_closing

    def is_reading(self) -> bool:
        return self._reads

    def pause_reading(self) -> None:
        self._reads = False

    def resume_reading(self) -> None:
        self._reads = True
        while self._unread and self._reads:
            self._protocol.data_received(self._unread.popleft())

    def write(self, data: bytes | bytearray | memoryview[Any]) -> None:
        if self._is_closing or not data:
            return
        self._written += len(data)
        self._unsent.append(bytes(data))
        self._send_unsent()
        if self._unsent and not self._is_paused:
            self._is_paused = True
            self._protocol.pause_writing()

    def close(self) -> None:
        if not self._is_closing:
            self._is_closing = True
            if not self._unsent:
                self._end()

    def abort(self) -> None:
        self._is_closing = True
        self._unsent.clear()
        self._end()

    # link of the flow control

    def sample(self) -> LinkSample:
        """Return the measurements of the link; raise OSError once it is closed."""
        if self._is_lost:
            raise OSError("closed")
        round_trip = self.downlink.quality.delay_us + self.uplink.quality.delay_us
        return LinkSample(self._in_flight + self.get_write_buffer_size(), round_trip, round_trip, self._written)

    def probe(self, _size: int, /) -> bytes:
        """Return no bytes: acknowledgements are known."""
        return b""

    def receive_probe_echo(self, payload: bytes) -> bool:  # noqa: ARG002
        """Ignore a Pong: `probe` sends no Ping."""
        return False

    def set_corked(self, corked: bool) -> None:
        """Do nothing: packets have no size here."""

    def use_loss_based_congestion(self) -> None:
        """Do nothing: the link has no congestion control of its own."""

    # client's side

    def send_to_server(self, frame: bytes) -> None:
        """Send bytes from the client."""
        if self._client.is_alive and not self._is_lost:
            self.uplink.send(partial(self._on_server_data, frame), len(frame))

    def close_from_client(self) -> None:
        """Reset the connection from the client's side."""
        self.on_data, self.on_lost = lambda _: None, lambda: None
        self.downlink.reset()
        if not self._is_lost:
            self.uplink.send(self._on_reset)

    # events

    def _send_unsent(self) -> None:
        while self._unsent and self._in_flight < KERNEL_BUFFER_BYTES:
            data = self._unsent.popleft()
            self._in_flight += len(data)
            self.downlink.send(partial(self._arrive, data), len(data))

    def _arrive(self, data: bytes) -> None:
        self._server.call_later(self.uplink.quality.delay_us, self._acknowledge, len(data))
        self.on_data(data)

    def _acknowledge(self, size: int) -> None:
        self._in_flight -= size
        if self._is_lost:
            return
        self._send_unsent()
        if self._is_closing and not self._unsent:
            self._end()
        elif self._is_paused and not self._unsent:
            self._is_paused = False
            self._protocol.resume_writing()

    def _on_server_data(self, data: bytes) -> None:
        if self._is_closing:
            return
        if self._reads:
            self._protocol.data_received(data)
        else:
            self._unread.append(data)

    def _on_reset(self) -> None:
        self._is_closing = True
        self._unsent.clear()
        self._end()

    def _end(self) -> None:
        if not self._is_lost:
            self._is_lost = True
            if self._server.is_alive and self._protocol is not None:
                # not in the order of a set, which differs from run to run
                self._server.call_later(self.random.randrange(100), self._protocol.connection_lost, None)
            self.downlink.send(lambda: self.on_lost())

    def _on_server_killed(self) -> None:
        self._is_lost = self._is_closing = True
        self.downlink.send(lambda: self.on_lost())

    def _on_client_killed(self) -> None:
        self.uplink.send(self._on_reset)


def encode_client_frame(payload: bytes, opcode: Opcode = Opcode.BINARY) -> bytes:
    """Return a frame of a client, with a mask of zeros (RFC 6455, section 5.3)."""
    size = len(payload)
    head = bytes((0x80 | opcode, 0x80 | size)) if size < 126 else struct.pack(">BBH", 0x80 | opcode, 0x80 | 126, size)
    return head + bytes(4) + payload
