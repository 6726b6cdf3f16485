"""One of a crowd: a socket that takes in what a viewer is sent, and keeps only when it came."""

from __future__ import annotations

import time
from array import array
from collections.abc import Mapping

from bunraku.client.message_socket import MessageSocket
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, read_timing
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.timeline import Timelines, position_at
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import ChannelHeader, Data, Description, Ping, Pong, Problem, Report, TimelineState, unpack
from bunraku.wire.overlay import Overlay

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


class CrowdViewer(MessageSocket):
    """One viewer, from its connection on."""

    __slots__ = ("_blocks", "_held", "_last", "_now", "_pulled", "_ready", "_shared")

    def __init__(self, url: str, shared: Shared, headers: Mapping[str, str] | None = None) -> None:
        """Of the stream at `url`, with what `headers` its request has beside its own."""
        super().__init__(url, headers)
        self._shared = shared
        self._now = 0
        self._held: set[int] = set()
        self._blocks = 0
        self._ready = 0
        self._last = 0
        self._pulled = False

    def speak(self, sequence: int) -> None:
        """Say what a viewer says each second."""
        ping = Ping(sequence & 0xFFFFFFFF, time.monotonic_ns() // 1000)
        self.send(ping.pack(), Report(max(self._ready - self._shared.now(), 0)).pack())

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        self._shared.octets += len(data)
        self._now = self._shared.now()
        super().data_received(data)

    def take(self, message: bytes) -> None:
        """Count what has come."""
        kind, shared, now = message[0], self._shared, self._now
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
            # the first of these tells the time
            self._now = shared.now()

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


def _kept(microseconds: int) -> int:
    """What fits into 32 bits: half an hour."""
    return min(max(microseconds, -(1 << 31)), (1 << 31) - 1)
