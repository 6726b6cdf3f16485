"""Counters of one stream replica, and the set of its viewers.

Data that is written to many viewers at once is counted once for all of them; data for one viewer, such as a first block
or an overlay on a constrained link, where it is written.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Literal, Protocol

from bunraku.websocket.connection import WebSocketConnection

StreamKind = Literal["motion", "session"]
TIMEOUT_REASON = "Silent"
"""Reason counted for a viewer whose heartbeat timed out."""


class CountedViewer(Protocol):
    """Viewer, as far as it is counted."""

    connection: WebSocketConnection

    @property
    def choice(self) -> tuple[int, str] | None:
        """Level of the motion that is sent, and the reason in a `Choice`; None before a motion is set."""


class StreamCounters:
    """Counters since the start of the process; they only grow."""

    def __init__(self) -> None:
        self.bytes = 0
        """Bytes written after the handshake: frames with their headers, Pongs and heartbeats included."""
        self.blocks = 0
        self.overlays = 0
        self.skipped_overlays = 0
        """Overlays replaced by a newer one before the link had capacity."""
        self.joined: Counter[tuple[str, ...]] = Counter({("motion",): 0, ("session",): 0})
        self.dropped: Counter[tuple[str, ...]] = Counter({("Too slow",): 0, (TIMEOUT_REASON,): 0})
        """Viewers that the server disconnected, by reason."""
        self._viewers: dict[StreamKind, set[CountedViewer]] = {"motion": set(), "session": set()}

    def count_writes(self, connection: WebSocketConnection) -> None:
        """Count the bytes written to this connection from now on, except those of multicast writes."""
        write = connection.write

        def counted_write(data: bytes | bytearray | memoryview[int]) -> None:
            self.bytes += len(data)
            write(data)

        connection.write = counted_write

    def add_viewer(self, viewer: CountedViewer, kind: StreamKind, on_end: Callable[[], None]) -> Callable[[], None]:
        """Count a viewer as connected until the returned function is called, which also calls `on_end`."""
        self.joined[(kind,)] += 1
        viewers = self._viewers[kind]
        viewers.add(viewer)

        def remove_viewer() -> None:
            viewers.discard(viewer)
            on_end()

        return remove_viewer

    def viewers_by_kind(self) -> dict[tuple[str, ...], int]:
        """Return the number of connected viewers, by kind of stream."""
        return {(kind,): len(viewers) for kind, viewers in self._viewers.items()}

    def viewers_by_level(self) -> Counter[tuple[str, ...]]:
        """Return the number of connected viewers, by bitrate level and reason."""
        found: Counter[tuple[str, ...]] = Counter()
        for viewer in self:
            if (choice := viewer.choice) is not None:
                found[str(choice[0]), choice[1]] += 1
        return found

    def unsent_bytes(self) -> list[int]:
        """Return the bytes buffered in the process, for each viewer whose connection is not writable."""
        return [viewer.connection.buffered_bytes for viewer in self if not viewer.connection.is_writable]

    def __iter__(self) -> Iterator[CountedViewer]:
        for viewers in self._viewers.values():
            yield from tuple(viewers)
