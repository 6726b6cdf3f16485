"""Who watches at one replica, and what they were sent: plain numbers, which only grow, and the viewers themselves.

What goes to many at once is counted once for all of them, and what goes to one, a first block or an overlay over a
narrow line, where it is written.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Literal, Protocol

from bunraku.websocket.connection import WebSocketConnection

StreamKind = Literal["motion", "session"]
TIMEOUT_REASON = "Silent"
"""Why one is dropped of whom nothing is heard any more."""


class CountedViewer(Protocol):
    """A viewer, as it is counted."""

    connection: WebSocketConnection

    @property
    def choice(self) -> tuple[int, str] | None:
        """The motion's rate that it is sent, and why, in a word of `Choice`; None where there is none yet."""


class StreamCounters:
    """Of one replica, since it began."""

    def __init__(self) -> None:
        self.bytes = 0
        """Written to viewers once they had been shaken hands with: frames whole, answers and signs of life too."""
        self.blocks = 0
        self.overlays = 0
        self.skipped_overlays = 0
        """Overlays that a newer one took the place of, as the line had no room."""
        self.joined: Counter[tuple[str, ...]] = Counter({("motion",): 0, ("session",): 0})
        self.dropped: Counter[tuple[str, ...]] = Counter({("Too slow",): 0, (TIMEOUT_REASON,): 0})
        """Viewers that were ended from here, by why."""
        self._viewers: dict[StreamKind, set[CountedViewer]] = {"motion": set(), "session": set()}

    def count_writes(self, connection: WebSocketConnection) -> None:
        """Count what is written to this outlet from now on, but for what is written to many together."""
        write = connection.write

        def counted(data: bytes | bytearray | memoryview[int]) -> None:
            self.bytes += len(data)
            write(data)

        connection.write = counted

    def add_viewer(self, viewer: CountedViewer, kind: StreamKind, on_end: Callable[[], None]) -> Callable[[], None]:
        """A viewer of this kind is here until the answer is called, which calls `ended`."""
        self.joined[(kind,)] += 1
        here = self._viewers[kind]
        here.add(viewer)

        def go() -> None:
            here.discard(viewer)
            on_end()

        return go

    def viewers_by_kind(self) -> dict[tuple[str, ...], int]:
        """How many there are, by their kind."""
        return {(kind,): len(viewers) for kind, viewers in self._viewers.items()}

    def viewers_by_level(self) -> Counter[tuple[str, ...]]:
        """How many have which rate, and why."""
        found: Counter[tuple[str, ...]] = Counter()
        for viewer in self:
            if (choice := viewer.choice) is not None:
                found[str(choice[0]), choice[1]] += 1
        return found

    def unsent_bytes(self) -> list[int]:
        """Of each viewer to whom not all that was written has gone, the bytes that are still in the process."""
        return [viewer.connection.buffered_bytes for viewer in self if not viewer.connection.is_writable]

    def __iter__(self) -> Iterator[CountedViewer]:
        for viewers in self._viewers.values():
            yield from tuple(viewers)
