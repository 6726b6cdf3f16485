"""Whether a viewer is there still: one of whom nothing is heard is asked, and given up when nothing comes."""

from __future__ import annotations

from bunraku.websocket.connection import WebSocketConnection

PING_AFTER_US = 12_000_000
"""A viewer of whom nothing was heard for this long, microseconds, is asked for a sign of life."""
HEARTBEAT_TIMEOUT_US = 18_000_000
"""One of whom nothing was heard for this long is there no more."""


class Heartbeat:
    """Of one viewer. Times are clock times in microseconds."""

    __slots__ = ("_pinged_at",)

    def __init__(self) -> None:
        # when it was heard last before it was asked
        self._pinged_at = 0

    def check(self, connection: WebSocketConnection, now: int) -> bool:
        """Whether it is there, so far as is known; asks where that is long ago."""
        silence = now - connection.last_received_at
        if PING_AFTER_US < silence <= HEARTBEAT_TIMEOUT_US and connection.last_received_at != self._pinged_at:
            self._pinged_at = connection.last_received_at
            connection.send_ping()
        return silence <= HEARTBEAT_TIMEOUT_US

    def next_check(self, connection: WebSocketConnection) -> int:
        """When to look next."""
        return (
            connection.last_received_at
            + (HEARTBEAT_TIMEOUT_US if connection.last_received_at == self._pinged_at else PING_AFTER_US)
            + 1
        )
