"""Open connections of a server, at most as many as it has files for."""

from __future__ import annotations

from collections import defaultdict
from typing import Any, Protocol


class OpenConnection(Protocol):
    """Protocol of an open connection."""

    source: str
    """Address of the client."""

    def abort(self) -> None:
        """End the connection at once."""


class OpenConnections(set[Any]):
    """Set of open connections, in place of uvicorn's.

    When it is full, the address with the most connections makes room: its newest connection is aborted, which may be
    the one that is added. Thus no address can keep others from connecting.
    """

    def __init__(self, capacity: int) -> None:
        super().__init__()
        self._capacity = capacity
        self._by_source: defaultdict[str, dict[OpenConnection, None]] = defaultdict(dict)

    def add(self, connection: OpenConnection) -> None:
        """Add a connection, and end one if there are too many."""
        super().add(connection)
        self._by_source[connection.source][connection] = None
        if len(self) > self._capacity:
            largest = max(self._by_source, key=lambda source: len(self._by_source[source]))
            newest = next(reversed(self._by_source[largest]))
            self.discard(newest)
            newest.abort()

    def discard(self, connection: OpenConnection) -> None:  # type: ignore[override]
        """Remove a connection if it is present."""
        super().discard(connection)
        source = self._by_source.get(connection.source, {})
        source.pop(connection, None)
        if not source:
            self._by_source.pop(connection.source, None)

    def remove(self, connection: OpenConnection) -> None:
        """Remove a connection: uvicorn calls this for each that ends, even if it has made room before."""
        self.discard(connection)
