"""Connection of a puppeteer on the replica that accepted it: send queue, rate limit and heartbeats to the stage."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque
from collections.abc import Callable
from typing import Protocol

from bunraku.runtime.token_bucket import TokenBucket
from bunraku.session.counters import RATE_LIMITED, SessionCounters
from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S, NoticeThrottle
from bunraku.session.stage_endpoint import PUPPETEER_HEARTBEAT_S
from bunraku.websocket.connection import CLOSED_CONNECTION, BinaryListener, FrameLimit, WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.heartbeat import Heartbeat
from bunraku.websocket.subprotocol import POLICY_VIOLATION, TRY_AGAIN_LATER, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Input, Ping, Pong, unpack

MAX_QUEUED_MESSAGES = 64
"""Size of the send queue."""
PUPPETEER_FRAMES = FrameLimit(2.0 * MAX_MESSAGES_PER_S, 2.0 * MAX_MESSAGES_PER_S)
"""Limit above which a puppeteer is disconnected."""


class PuppeteerStage(Protocol):
    """Stage of a puppeteer, on any replica."""

    def send(self, puppeteer: PuppeteerConnection, message: bytes | None) -> None:
        """Send a puppeteer's message; None means that the puppeteer has left, no bytes are a heartbeat."""


class PuppeteerConnection(BinaryListener):
    """Listener of a puppeteer's WebSocket. Messages of the stage are queued until `open` is called."""

    def __init__(self, stage: PuppeteerStage, counters: SessionCounters, clock: Callable[[], int]) -> None:
        """`counters` count the inputs that the rate limit drops; `clock` returns microseconds."""
        self.id = secrets.token_hex(5)
        self._stage = stage
        self._counters = counters
        self._clock = clock
        self._connection: WebSocketConnection = CLOSED_CONNECTION
        self._is_open = False
        self._queued: deque[bytes] = deque()
        self._close_reason: CloseConnection | None = None
        self._notice_throttle = NoticeThrottle()
        self._message_rate = TokenBucket(MAX_MESSAGES_PER_S, MAX_MESSAGES_PER_S)
        self._heartbeat = Heartbeat()
        self._heartbeat_timer: asyncio.TimerHandle | None = None

    def open(self, connection: WebSocketConnection) -> None:
        """Send the queued messages, and heartbeats to the stage from now on."""
        self._connection, self._is_open = connection, True
        self._send_heartbeat()
        if self._close_reason is not None:
            connection.close_with_problem(self._close_reason)
        else:
            self.on_resume()

    def send(self, message: bytes) -> None:
        """Send a message of the stage; an empty one means that the stage no longer knows this puppeteer."""
        if not message:
            self.close(
                CloseConnection(
                    TRY_AGAIN_LATER, "Session elsewhere", "another server has taken over the session; reconnect"
                )
            )
        elif self._connection.is_writable:
            self._connection.write(encode_frame(message))
        elif len(self._queued) < MAX_QUEUED_MESSAGES:
            self._queued.append(encode_frame(message))
        else:
            detail = f"{MAX_QUEUED_MESSAGES} messages were queued; reconnect"
            self.close(CloseConnection(TRY_AGAIN_LATER, "Too slow", detail))

    def close(self, reason: CloseConnection) -> None:
        """Close the connection with a reason, once it is open."""
        if self._is_open:
            self._connection.close_with_problem(reason)
        else:
            self._close_reason = self._close_reason or reason

    def on_message(self, message: bytes) -> None:
        """Handle a message of the puppeteer; raise `CloseConnection` if it is malformed."""
        try:
            received = unpack(message)
        except MalformedMessage as error:
            raise CloseConnection(POLICY_VIOLATION, "Malformed message", str(error)) from None
        now = self._clock()
        is_within_rate = self._message_rate.take(now * 1e-6)
        if isinstance(received, Input) and not is_within_rate:
            self._counters.inputs[RATE_LIMITED] += 1
            notice = self._notice_throttle.make_notice(received.limb, "rate", now)
            if notice is not None:
                self.send(notice)
        elif isinstance(received, Ping):
            self.send(Pong(received.sequence, received.sent, now, now).pack())
        else:
            self._stage.send(self, message)

    def on_pong(self, payload: bytes) -> bool:  # noqa: ARG002
        """Ignore a Pong: no Ping with a payload is sent."""
        return False

    def on_pause(self) -> None:
        """Do nothing: messages are queued while the connection is not writable."""

    def on_resume(self) -> None:
        """Send the queued messages."""
        if self._queued:
            self._connection.write(b"".join(self._queued))
            self._queued.clear()

    def on_close(self) -> None:
        """End the heartbeats."""
        if self._heartbeat_timer is not None:
            self._heartbeat_timer.cancel()

    def _send_heartbeat(self) -> None:
        """Send the stage a heartbeat while the client answers, and schedule the next."""
        if not self._heartbeat.check(self._connection, self._clock()):
            self._connection.abort()
            return
        self._stage.send(self, b"")
        self._heartbeat_timer = asyncio.get_running_loop().call_later(PUPPETEER_HEARTBEAT_S, self._send_heartbeat)
