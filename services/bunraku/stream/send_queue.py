"""What waits for one viewer until its line has room: answers, messages that must arrive, and the newest overlay."""

from __future__ import annotations

from bunraku.runtime.clock import clock
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import Ping, Pong

MAX_CONTROL_MESSAGES = 64
"""Messages that may wait for a viewer."""
MAX_PENDING_PINGS = 8
"""Pings whose answers may wait; more are not answered."""


class SendQueue:
    """All frames, but for pings: their answers tell when they leave."""

    __slots__ = ("_control", "_pings", "overlay")

    def __init__(self) -> None:
        self._pings: list[tuple[Ping, int]] = []
        self._control: list[bytes] = []
        self.overlay: bytes | None = None
        """The newest; one that was not sent is replaced by the next."""

    def __bool__(self) -> bool:
        """Whether anything waits."""
        return bool(self._pings or self._control or self.overlay is not None)

    def add_ping(self, ping: Ping, now: int) -> None:
        """A ping that came at clock time `now`, microseconds."""
        if len(self._pings) < MAX_PENDING_PINGS:
            self._pings.append((ping, now))

    def add_control(self, framed: bytes) -> bool:
        """A message that must arrive; whether there is room for it."""
        if len(self._control) >= MAX_CONTROL_MESSAGES:
            return False
        self._control.append(framed)
        return True

    def take_pongs(self) -> list[bytes]:
        """Take the answers to the pings."""
        pings, self._pings = self._pings, []
        return [encode_frame(Pong(ping.sequence, ping.sent, received, clock()).pack()) for ping, received in pings]

    def take_control(self) -> list[bytes]:
        """Take what must arrive."""
        control, self._control = self._control, []
        return control

    def take_overlay(self) -> bytes | None:
        """Take the newest overlay."""
        overlay, self.overlay = self.overlay, None
        return overlay
