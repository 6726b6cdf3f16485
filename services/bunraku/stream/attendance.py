"""Who watches at one replica, and what they were sent: plain numbers, which only grow, and the viewers themselves.

What goes to many at once is counted once for all of them, and what goes to one, a first block or an overlay over a
narrow line, where it is written.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Literal, Protocol

from bunraku.backing.outlet import Outlet

Kind = Literal["motion", "session"]
SILENT = "Silent"
"""Why one is dropped of whom nothing is heard any more."""


class Present(Protocol):
    """A viewer, as it is counted."""

    outlet: Outlet

    @property
    def choice(self) -> tuple[int, str] | None:
        """The motion's rate that it is sent, and why, in a word of `Choice`; None where there is none yet."""


class Attendance:
    """Of one replica, since it began."""

    def __init__(self) -> None:
        self.bytes = 0
        """Written to viewers once they had been shaken hands with: frames whole, answers and signs of life too."""
        self.blocks = 0
        self.overlays = 0
        self.skipped = 0
        """Overlays that a newer one took the place of, as the line had no room."""
        self.came: Counter[tuple[str, ...]] = Counter({("motion",): 0, ("session",): 0})
        self.dropped: Counter[tuple[str, ...]] = Counter({("Too slow",): 0, (SILENT,): 0})
        """Viewers that were ended from here, by why."""
        self._here: dict[Kind, set[Present]] = {"motion": set(), "session": set()}

    def count(self, outlet: Outlet) -> None:
        """Count what is written to this outlet from now on, but for what is written to many together."""
        write = outlet.write

        def counted(data: bytes | bytearray | memoryview[int]) -> None:
            self.bytes += len(data)
            write(data)

        outlet.write = counted

    def come(self, viewer: Present, kind: Kind, ended: Callable[[], None]) -> Callable[[], None]:
        """A viewer of this kind is here until the answer is called, which calls `ended`."""
        self.came[(kind,)] += 1
        here = self._here[kind]
        here.add(viewer)

        def go() -> None:
            here.discard(viewer)
            ended()

        return go

    def here(self) -> dict[tuple[str, ...], int]:
        """How many there are, by their kind."""
        return {(kind,): len(viewers) for kind, viewers in self._here.items()}

    def choices(self) -> Counter[tuple[str, ...]]:
        """How many have which rate, and why."""
        found: Counter[tuple[str, ...]] = Counter()
        for viewer in self:
            if (choice := viewer.choice) is not None:
                found[str(choice[0]), choice[1]] += 1
        return found

    def waiting(self) -> list[int]:
        """Of each viewer to whom not all that was written has gone, the bytes that are still in the process."""
        return [viewer.outlet.waiting for viewer in self if not viewer.outlet.clear]

    def __iter__(self) -> Iterator[Present]:
        for viewers in self._here.values():
            yield from tuple(viewers)
