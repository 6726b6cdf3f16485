"""Connection of a live performer on the replica that accepted it: samples to the stage and to the store."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable
from typing import Protocol

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.token_bucket import TokenBucket
from bunraku.session.live.sample_json import MAX_SAMPLE_BYTES, parse_sample
from bunraku.session.stage_endpoint import PUPPETEER_HEARTBEAT_S
from bunraku.storage.performance_store import MAX_DURATION_US, PerformanceHeader, PerformanceStore
from bunraku.websocket.connection import CLOSED_CONNECTION, FrameLimit, WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.heartbeat import Heartbeat
from bunraku.websocket.subprotocol import NOT_FOUND, POLICY_VIOLATION, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.live import Sample
from bunraku.wire.messages import Ping, Pong, unpack

MAX_SAMPLES_PER_S = 300.0
"""Samples above this rate are dropped: the highest nominal rate is 240."""
SAMPLE_BURST = 150.0
PERFORMER_FRAMES = FrameLimit(2.0 * MAX_SAMPLES_PER_S, 2.0 * MAX_SAMPLES_PER_S, MAX_SAMPLE_BYTES)
"""Limit above which a performer is disconnected."""
PART_DURATION_S = 1.0
"""Interval at which samples are stored: a killed server loses no more."""
HEADER_INTERVAL_S = 20.0
"""Interval at which the header is stored again, which shows that the performance goes on."""
MAX_UNSTORED_BYTES = 2 << 20
"""Samples that wait while the store is unavailable, a minute at the highest rate; then the oldest are dropped."""
MAX_AGE_US = 10_000_000
"""Samples older than this are not stored."""
MAX_AHEAD_US = 200_000

_log = logging.getLogger(__name__)


class PerformerStage(Protocol):
    """Stage of a performer, on any replica."""

    def send_sample(self, performer: str, connection: str, message: bytes | None) -> None:
        """Send a packed Sample; no bytes are a heartbeat, None means that the connection has ended."""


class PerformerConnection:
    """Listener of a performer's WebSocket."""

    def __init__(
        self, stage: PerformerStage, header: PerformanceHeader, store: PerformanceStore, clock: Callable[[], int]
    ) -> None:
        """`clock` returns microseconds."""
        self.id = secrets.token_hex(5)
        self._stage = stage
        self._header = header
        self._store = store
        self._clock = clock
        self._connection: WebSocketConnection = CLOSED_CONNECTION
        self._sample_rate = TokenBucket(MAX_SAMPLES_PER_S, SAMPLE_BURST)
        self._unstored = bytearray()
        self._part_count = 0
        self._heartbeat = Heartbeat()
        self._heartbeat_timer: asyncio.TimerHandle | None = None
        self._has_closed = asyncio.Event()

    def open(self, connection: WebSocketConnection) -> None:
        """Send heartbeats to the stage from now on. Run `store_samples` meanwhile."""
        self._connection = connection
        self._send_heartbeat()

    def receive_told(self, connection: bytes) -> None:
        """Handle which connection is the performer's: none if the performance has ended."""
        if not connection:
            self.close(CloseConnection(NOT_FOUND, "Performance ended", "this performance has ended"))
        elif connection != self.id.encode():
            self.close(CloseConnection(POLICY_VIOLATION, "Replaced", "the performer has connected again elsewhere"))

    def close(self, reason: CloseConnection) -> None:
        """Close the connection with a reason."""
        self._connection.close_with_problem(reason)

    def on_message(self, message: bytes) -> None:
        """Handle a message of the performer; raise `CloseConnection` if it is malformed."""
        try:
            received = unpack(message)
        except MalformedMessage as error:
            raise CloseConnection(POLICY_VIOLATION, "Malformed message", str(error)) from None
        now = self._clock()
        if isinstance(received, Ping):
            if self._connection.is_writable:
                self._connection.write(encode_frame(Pong(received.sequence, received.sent, now, now).pack()))
        elif isinstance(received, Sample):
            self._add_sample(received, now)

    def on_text(self, text: bytes) -> None:
        """Handle a sample in JSON; raise `CloseConnection` if it is malformed."""
        now = self._clock()
        try:
            sample = parse_sample(text, now)
        except ProblemError as error:
            raise CloseConnection(POLICY_VIOLATION, "Malformed sample", f"{error.title}: {error.detail}") from None
        self._add_sample(sample, now)

    def _add_sample(self, sample: Sample, now: int) -> None:
        if not self._sample_rate.take(now * 1e-6):
            return
        packed = sample.pack()
        self._stage.send_sample(self._header.id, self.id, packed)
        is_recent = -MAX_AGE_US <= sample.sampled - now <= MAX_AHEAD_US
        if is_recent and sample.sampled - self._header.created_us <= MAX_DURATION_US:
            self._unstored += packed

    def on_pong(self, payload: bytes) -> bool:  # noqa: ARG002
        """Ignore a Pong: no Ping with a payload is sent."""
        return False

    def on_pause(self) -> None:
        """Do nothing: a Pong that cannot be written is left out."""

    def on_resume(self) -> None:
        """Do nothing."""

    def on_close(self) -> None:
        """End the heartbeats, and store the last samples."""
        if self._heartbeat_timer is not None:
            self._heartbeat_timer.cancel()
        self._has_closed.set()

    async def store_samples(self) -> None:
        """Store the samples of each second until the connection has closed, then tell the stage."""
        header_at_us = self._clock()
        try:
            while not self._has_closed.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._has_closed.wait(), PART_DURATION_S)
                try:
                    await self._store_part()
                    if self._clock() - header_at_us >= HEADER_INTERVAL_S * 1e6:
                        header_at_us = self._clock()
                        await self._store.put_header(self._header)
                except (BackendUnavailable, ProblemError) as error:
                    _log.warning("samples of performer %s not stored: %s; trying again", self._header.id, error)
                    del self._unstored[: max(len(self._unstored) - MAX_UNSTORED_BYTES, 0)]
        finally:
            self._stage.send_sample(self._header.id, self.id, None)

    async def _store_part(self) -> None:
        if not self._unstored:
            return
        samples = bytes(self._unstored)
        await self._store.put_part(self._header.id, f"{self.id}-{self._part_count}", samples)
        self._part_count += 1
        del self._unstored[: len(samples)]

    def _send_heartbeat(self) -> None:
        """Send the stage a heartbeat while the client answers, and schedule the next."""
        if not self._heartbeat.check(self._connection, self._clock()):
            self._connection.abort()
            return
        self._stage.send_sample(self._header.id, self.id, b"")
        self._heartbeat_timer = asyncio.get_running_loop().call_later(PUPPETEER_HEARTBEAT_S, self._send_heartbeat)
