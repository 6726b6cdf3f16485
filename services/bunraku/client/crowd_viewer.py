"""One of a crowd: a socket that takes in what a viewer is sent, and keeps only when it came."""

from __future__ import annotations

import asyncio
import base64
import secrets
import time
from array import array
from typing import cast
from urllib.parse import SplitResult

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, read_timing
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.timeline import Timelines, position_at
from bunraku.wire.messages import (
    SUBPROTOCOL,
    ChannelHeader,
    Data,
    Description,
    MalformedMessage,
    Overlay,
    Ping,
    Pong,
    Problem,
    Report,
    TimelineState,
    unpack,
)

AHEAD = 6_000_000
"""No server sends blocks further ahead than this, microseconds."""
SETTLED = 0.2
"""Seconds in which the common clock moves too little to be asked again."""


class Shared:
    """What a crowd has in common: its clock, the stage's timeline, and what is counted, in microseconds: how late
    overlays and blocks came, and the time between two overlays at one viewer while a limb is pulled."""

    def __init__(self) -> None:
        self.clock = ReferenceClock()
        self.timelines = Timelines()
        self.timing: Timing | None = None
        self.overlays = array("i")
        self.gaps = array("i")
        self.blocks = array("i")
        self.stalls = 0
        self.octets = 0
        self.why: str | None = None
        self._base = 0
        self._offset = 0
        self._asked = 0.0
        self._known: dict[bytes, None] = {}

    def now(self) -> int:
        """The reference clock."""
        local = time.monotonic_ns() // 1000
        if local - self._base > SETTLED * 1e6:
            self._base, self._offset = local, self.clock.at(local) - local
        return local + self._offset

    def heard(self, pong: Pong) -> None:
        """Take in an answer that tells the time."""
        if not self.clock.ready:
            self._base = 0
        self.clock.pong(pong.sent, pong.received, pong.answered, time.monotonic_ns() // 1000)

    def know(self, data: bytes) -> None:
        """Take in what is the same for everyone, once."""
        if data in self._known:
            return
        if len(self._known) > 64:
            self._known.clear()
        self._known[data] = None
        try:
            message = unpack(data)
        except MalformedMessage as error:
            self.why = str(error)
            return
        if isinstance(message, TimelineState):
            self.timelines.put(message)
        elif isinstance(message, ChannelHeader):
            self.clock.guess(message.now, time.monotonic_ns() // 1000)
            self._base = 0
        elif isinstance(message, Problem):
            self.why = f"{message.title}: {message.detail}"
        elif isinstance(message, Description):
            tracks = [track for track in message.tracks if track.get("type") == "motion"]
            try:
                self.timing = read_timing(tracks[0], "motion") if tracks else None
            except DamagedBlock as error:
                self.why = str(error)


class CrowdViewer(asyncio.Protocol):
    """One viewer, from its connection on; `opened` is done when the server has agreed to talk."""

    __slots__ = (
        "_blocks", "_buffer", "_held", "_last", "_parts", "_pulled", "_ready", "_shared", "_transport", "closed",
        "opened",
    )  # fmt: skip

    def __init__(self, parts: SplitResult, shared: Shared) -> None:
        """`parts` of the stream's URL."""
        self._parts = parts
        self._shared = shared
        self._buffer = b""
        self._held: set[int] = set()
        self._blocks = 0
        self._ready = 0
        self._last = 0
        self._pulled = False
        self.closed = False
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """As asyncio has it."""
        self._transport = cast(asyncio.Transport, transport)
        key = base64.b64encode(secrets.token_bytes(16)).decode()
        target = self._parts.path + (f"?{self._parts.query}" if self._parts.query else "")
        lines = (
            f"GET {target} HTTP/1.1", f"Host: {self._parts.netloc}", "Upgrade: websocket", "Connection: Upgrade",
            f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: {SUBPROTOCOL}", "", "",
        )  # fmt: skip
        self._transport.write("\r\n".join(lines).encode())

    def speak(self, sequence: int) -> None:
        """Say what a viewer says each second."""
        if not self.closed and not self._transport.is_closing():
            now = self._shared.now()
            ping = Ping(sequence & 0xFFFFFFFF, time.monotonic_ns() // 1000).pack()
            self._transport.write(_masked(2, ping) + _masked(2, Report(max(self._ready - now, 0)).pack()))

    def close(self) -> None:
        """Go."""
        if not self._transport.is_closing():
            self._transport.write(_masked(8, (1001).to_bytes(2, "big")))
            self._transport.close()

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        shared = self._shared
        now = shared.now()
        shared.octets += len(data)
        if self._buffer:
            data, self._buffer = self._buffer + data, b""
        at, end = 0, len(data)
        if not self.opened.done():
            head, found, _ = data.partition(b"\r\n\r\n")
            if not found:
                self._buffer = data
                return
            first = head.split(b"\r\n", 1)[0]
            if b" 101 " not in first + b" ":
                self.opened.set_exception(ConnectionError(f"the server answered {first.decode(errors='replace')}"))
                self._transport.close()
                return
            self.opened.set_result(None)
            at = len(head) + 4
        while end - at >= 2:
            size, body = data[at + 1], at + 2
            if size >= 126:
                wide = 2 if size == 126 else 8
                size, body = int.from_bytes(data[body : body + wide], "big"), body + wide
            if body + size > end:
                break
            if data[at] == 0x82 and size:
                if data[body] == ChannelHeader.TYPE:
                    shared.know(data[body : body + size])
                    now = shared.now()
                self._take(data[body : body + size], now)
            elif data[at] == 0x89:
                self._transport.write(_masked(10, data[body : body + size]))
            elif data[at] == 0x88 and not self.closed:
                self.closed = True
                self.close()
            at = body + size
        self._buffer = data[at:]

    def _take(self, message: bytes, now: int) -> None:
        kind, shared = message[0], self._shared
        if kind == Overlay.TYPE:
            shared.overlays.append(_kept(now - int.from_bytes(message[4:12], "little")))
            if self._pulled:
                shared.gaps.append(_kept(now - self._last))
            self._last, self._pulled = now, bool(message[1] & 15)
        elif kind == Data.TYPE:
            self._block(message, now)
        elif kind == Pong.TYPE:
            shared.heard(Pong.unpack(message))
        else:
            shared.know(message)

    def _block(self, message: bytes, now: int) -> None:
        shared = self._shared
        state, timing, data = shared.timelines.at(now), shared.timing, Data.unpack(message)
        # of the motion alone, and of each block the version that comes first
        if state is None or timing is None or data.track or data.index in self._held:
            return
        self._held.add(data.index)
        length = round(timing.frames_in(data.index) * 1e6 / timing.fps)
        ahead = timing.start_us(data.index) - position_at(state, now)
        if state.loop:
            # what comes round again is ahead by less than is sent ahead, or has begun
            begun = min(state.duration // 2, max(length, state.duration - AHEAD))
            ahead = (ahead + begun) % state.duration - begun
        self._ready = max(self._ready, now + ahead + length)
        self._blocks += 1
        # the block on show when one joins has always begun
        if self._blocks > 1 and state.playing:
            shared.blocks.append(_kept(-ahead))
            shared.stalls += ahead < 0

    def connection_lost(self, error: Exception | None) -> None:
        """As asyncio has it."""
        self.closed = True
        if not self.opened.done():
            self.opened.set_exception(error or ConnectionError("the server closed the connection"))


def _masked(opcode: int, payload: bytes) -> bytes:
    """A client's frame of less than 126 bytes (RFC 6455, section 5.2); its mask is zero."""
    return bytes((0x80 | opcode, 0x80 | len(payload), 0, 0, 0, 0)) + payload


def _kept(microseconds: int) -> int:
    """What fits into 32 bits: half an hour."""
    return min(max(microseconds, -(1 << 31)), (1 << 31) - 1)
