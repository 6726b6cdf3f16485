"""Messages of one viewer that wait until its connection is writable.

They are Pongs, control messages, and the newest of each kind of message that shows limbs or performers.
"""

from __future__ import annotations

from collections.abc import Callable

from bunraku.websocket.frame import encode_frame, frame_payload
from bunraku.wire.live import Live
from bunraku.wire.messages import Ping, Pong
from bunraku.wire.overlay import Overlay

MAX_CONTROL_MESSAGES = 64
"""Control messages that may be queued for a viewer."""
MAX_PENDING_PINGS = 8
"""Pings that may wait for their Pong; further ones are not answered."""


class SendQueue:
    """Queue of encoded frames. Pings are kept as messages, since a Pong holds the time at which it is sent."""

    __slots__ = ("_clock", "_control", "_newest", "_pings")

    def __init__(self, clock: Callable[[], int]) -> None:
        """`clock` returns the reference time in microseconds."""
        self._clock = clock
        self._pings: list[tuple[Ping, int]] = []
        self._control: list[bytes] = []
        # by message type; Overlays of either type are one kind
        self._newest: dict[int, bytes] = {}

    def __bool__(self) -> bool:
        return bool(self._pings or self._control or self._newest)

    @property
    def has_newest(self) -> bool:
        """True if an Overlay or Live message waits."""
        return bool(self._newest)

    def put_newest(self, framed: bytes) -> bool:
        """Queue an Overlay or Live message in place of an unsent one of its kind; return whether there was one."""
        kind = Live.TYPE if frame_payload(framed)[0] == Live.TYPE else Overlay.TYPE
        was_unsent = kind in self._newest
        self._newest[kind] = framed
        return was_unsent

    def add_ping(self, ping: Ping, now: int) -> None:
        """Queue a Ping that was received at clock time `now`."""
        if len(self._pings) < MAX_PENDING_PINGS:
            self._pings.append((ping, now))

    def add_control(self, framed: bytes) -> bool:
        """Queue a message that must arrive; return False if the queue is full."""
        if len(self._control) >= MAX_CONTROL_MESSAGES:
            return False
        self._control.append(framed)
        return True

    def take_pongs(self) -> list[bytes]:
        """Remove the Pings and return their Pongs, framed."""
        pings, self._pings = self._pings, []
        return [
            encode_frame(Pong(ping.sequence, ping.sent, received, self._clock()).pack()) for ping, received in pings
        ]

    def take_control(self) -> list[bytes]:
        """Remove and return the control messages, framed, in their order."""
        control, self._control = self._control, []
        return control

    def take_newest(self) -> bytes | None:
        """Remove and return an Overlay or Live message, framed, the one that waits longest first."""
        kind = next(iter(self._newest), None)
        return None if kind is None else self._newest.pop(kind)
