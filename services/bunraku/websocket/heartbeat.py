"""Detection of clients that no longer answer. All times are clock times in microseconds."""

from __future__ import annotations

from bunraku.websocket.connection import WebSocketConnection

PING_AFTER_US = 12_000_000
"""A client that has been silent for this long is sent a WebSocket Ping, microseconds."""
HEARTBEAT_TIMEOUT_US = 18_000_000
"""A client that has been silent for this long is disconnected, microseconds."""


class Heartbeat:
    """Detection of a client that no longer answers."""

    __slots__ = ("_pinged_at",)

    def __init__(self) -> None:
        # `last_received_at` of the connection when the last Ping was sent
        self._pinged_at = 0

    def check(self, connection: WebSocketConnection, now: int) -> bool:
        """Return False if the client has timed out; send one Ping if it has been silent for long."""
        silence = now - connection.last_received_at
        if PING_AFTER_US < silence <= HEARTBEAT_TIMEOUT_US and connection.last_received_at != self._pinged_at:
            self._pinged_at = connection.last_received_at
            connection.send_ping()
        return silence <= HEARTBEAT_TIMEOUT_US

    def next_check(self, connection: WebSocketConnection) -> int:
        """Return the time of the next check."""
        return (
            connection.last_received_at
            + (HEARTBEAT_TIMEOUT_US if connection.last_received_at == self._pinged_at else PING_AFTER_US)
            + 1
        )
