"""Viewer of the load generator: receives messages and records only their times."""

from __future__ import annotations

import time
from array import array
from collections.abc import Mapping

from bunraku.client.message_socket import MessageSocket
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, parse_timing
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.timeline import TimelineHistory, position_at
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.live import Live
from bunraku.wire.messages import ChannelHeader, Data, Description, Ping, Pong, Problem, Report, TimelineState, unpack
from bunraku.wire.overlay import Overlay

MAX_SEND_AHEAD_US = 6_000_000
"""Upper bound of how far ahead servers send blocks."""
CLOCK_CACHE_S = 0.2
"""Time for which the shared clock's offset is cached."""


class LoadState:
    """State shared by all viewers of a load test: clock, timeline, and counts.

    Lateness of overlays, live poses and blocks, and gaps between overlays of a controlled limb, or between live poses,
    at one viewer, in microseconds.
    """

    def __init__(self) -> None:
        self.clock = ReferenceClock()
        self.timelines = TimelineHistory()
        self.timing: Timing | None = None
        self.overlay_lateness = array("i")
        self.overlay_gaps = array("i")
        self.live_lateness = array("i")
        self.live_gaps = array("i")
        self.block_lateness = array("i")
        self.stalls = 0
        self.received_bytes = 0
        self.error: str | None = None
        self._cached_at = 0
        self._cached_offset = 0
        self._asked = 0.0
        self._seen: dict[bytes, None] = {}

    def now(self) -> int:
        """Return the time on the reference clock, microseconds."""
        local = time.monotonic_ns() // 1000
        if local - self._cached_at > CLOCK_CACHE_S * 1e6:
            self._cached_at, self._cached_offset = local, self.clock.at(local) - local
        return local + self._cached_offset

    def on_pong(self, pong: Pong) -> None:
        """Add a clock sample."""
        if not self.clock.is_synchronised:
            self._cached_at = 0
        self.clock.add_sample(pong.sent, pong.received, pong.answered, time.monotonic_ns() // 1000)

    def process_shared(self, data: bytes) -> None:
        """Process a message that is the same for every viewer, once."""
        if data in self._seen:
            return
        if len(self._seen) > 64:
            self._seen.clear()
        self._seen[data] = None
        try:
            message = unpack(data)
        except MalformedMessage as error:
            self.error = str(error)
            return
        if isinstance(message, TimelineState):
            self.timelines.put(message)
        elif isinstance(message, ChannelHeader):
            self.clock.set_estimate(message.now, time.monotonic_ns() // 1000)
            self._cached_at = 0
        elif isinstance(message, Problem):
            self.error = f"{message.title}: {message.detail}"
        elif isinstance(message, Description):
            tracks = [track for track in message.tracks if track.get("type") == "motion"]
            try:
                self.timing = parse_timing(tracks[0], "motion") if tracks else None
            except DamagedBlock as error:
                self.error = str(error)


class LoadViewer(MessageSocket):
    """Connection of one viewer."""

    __slots__ = (
        "_block_count",
        "_buffered_until",
        "_is_controlled",
        "_last_live_at",
        "_last_overlay_at",
        "_received_at",
        "_received_blocks",
        "_state",
    )

    def __init__(self, url: str, state: LoadState, headers: Mapping[str, str] | None = None) -> None:
        """Prepare a viewer of the stream at `url`; `headers` are added to its request."""
        super().__init__(url, headers)
        self._state = state
        self._received_at = 0
        self._received_blocks: set[int] = set()
        self._block_count = 0
        self._buffered_until = 0
        self._last_live_at = 0
        self._last_overlay_at = 0
        self._is_controlled = False

    def send_report(self, sequence: int) -> None:
        """Send the ping and report that a viewer sends every second."""
        ping = Ping(sequence & 0xFFFFFFFF, time.monotonic_ns() // 1000)
        self.send(ping.pack(), Report(max(self._buffered_until - self._state.now(), 0)).pack())

    def data_received(self, data: bytes) -> None:
        self._state.received_bytes += len(data)
        self._received_at = self._state.now()
        super().data_received(data)

    def on_message(self, message: bytes) -> None:
        kind, shared, now = message[0], self._state, self._received_at
        if kind == Overlay.TYPE:
            shared.overlay_lateness.append(_clamp_int32(now - int.from_bytes(message[4:12], "little")))
            if self._is_controlled:
                shared.overlay_gaps.append(_clamp_int32(now - self._last_overlay_at))
            self._last_overlay_at, self._is_controlled = now, bool(message[1] & 15)
        elif kind == Live.TYPE:
            shared.live_lateness.append(_clamp_int32(now - int.from_bytes(message[2:10], "little")))
            if self._last_live_at:
                shared.live_gaps.append(_clamp_int32(now - self._last_live_at))
            # a mask of 0 is the last message for a while
            self._last_live_at = now if message[1] & 15 else 0
        elif kind == Data.TYPE:
            self._count_block(message, now)
        elif kind == Pong.TYPE:
            shared.on_pong(Pong.unpack(message))
        else:
            shared.process_shared(message)
            # the first of these sets the clock
            self._received_at = shared.now()

    def _count_block(self, message: bytes, now: int) -> None:
        shared = self._state
        state, timing, data = shared.timelines.at(now), shared.timing, Data.unpack(message)
        # only blocks of the motion, and the first version of each
        if state is None or timing is None or data.track or data.index in self._received_blocks:
            return
        self._received_blocks.add(data.index)
        length = round(timing.frames_in(data.index) * 1e6 / timing.fps)
        ahead = timing.start_us(data.index) - position_at(state, now)
        if state.loop:
            # a block of the next loop is closer than the send-ahead limit; otherwise it has started already
            begun = min(state.duration // 2, max(length, state.duration - MAX_SEND_AHEAD_US))
            ahead = (ahead + begun) % state.duration - begun
        self._buffered_until = max(self._buffered_until, now + ahead + length)
        self._block_count += 1
        # the first block has always started when a viewer joins
        if self._block_count > 1 and state.playing:
            shared.block_lateness.append(_clamp_int32(-ahead))
            shared.stalls += ahead < 0


def _clamp_int32(microseconds: int) -> int:
    """Clamp to 32 bits: about half an hour."""
    return min(max(microseconds, -(1 << 31)), (1 << 31) - 1)
