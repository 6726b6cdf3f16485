"""When there is room on one viewer's line, and whose turn it is where the live overlay and blocks share it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bunraku.backing.line import Reading
from bunraku.playout.window import Window, on_line

CLEAN = 64
"""So many times there was room at once before a line counts as quick."""
SKIPPED = 8
"""On a quick line the system is asked for every so many overlays."""
FAR = 20_000
"""Round trips that take longer, microseconds, may be those of a narrow line."""
BLOCKS = 0.3
"""The share of a narrow line that blocks get beside overlays."""


class Readable(Protocol):
    """A line that can be read, as `bunraku.backing.line.Line`."""

    def read(self) -> Reading:
        """How it stands now; raises OSError once it is closed."""

    def hold(self, held: bool) -> None:
        """Keep what is written together in packets as full as can be, or let it go."""


class Flow:
    """What one viewer's line can take now."""

    def __init__(self, line: Readable | None, now: Callable[[], int]) -> None:
        """`line` None: nothing is known of it, and there is always room; `now` tells microseconds."""
        self._line = line
        self._now = now
        self.window = Window()
        self._clean = 0
        self._skip = 0
        self._credit = 0.0
        self._credited_at = now()
        self.beginning = line is not None
        """Whether what is written is held until the first block is."""
        self.far = line is not None and line.read().round_trip > FAR
        """Whether answers take their time: the line may be a narrow one, or one that stands now and then."""

    def begun(self) -> None:
        """The first block was written, or there is none: what was held so far goes, in one packet."""
        if self.beginning and self._line is not None:
            self.beginning = False
            self._line.hold(False)

    def wrote(self, size: int) -> None:
        """Bytes were written, in one go."""
        if not self._skip and self._line is not None:
            self.window.wrote(self._now(), size)

    def quick(self) -> bool:
        """Whether an overlay may be written whole and at once: most often told without asking the system."""
        if self._skip:
            self._skip -= 1
            return True
        if self._line is None:
            return True
        if self.narrow or not self.room():
            self._clean = 0
            return False
        self._clean += 1
        if self._clean >= CLEAN:
            self._skip = SKIPPED
        return True

    def room(self) -> bool:
        """Whether something may be written now."""
        if self._line is None:
            return True
        now = self._now()
        if self.window.flying:
            try:
                reading = self._line.read()
            except OSError:
                # it is closed: whoever writes to it is told
                return True
            self.window.acknowledged(now, reading.waiting, reading.least)
        return self.window.room(now)

    @property
    def narrow(self) -> bool:
        """Whether the line was full of late."""
        return self._line is not None and self.window.narrow(self._now())

    @property
    def unknown(self) -> bool:
        """Whether the line may be narrow: nothing was acknowledged yet."""
        return self.far and self.window.rate is None

    @property
    def learning(self) -> bool:
        """Whether something is on its way that will tell of the line."""
        return self.unknown and self.window.flying > 0

    def block_went(self, size: int) -> None:
        """A block was written."""
        self._credit -= on_line(size)

    def blocks_turn(self) -> bool:
        """Whether a block that can wait may take room from overlays: on a narrow line they have a share of it."""
        now, rate = self._now(), self.window.rate or 0.0
        self._credit += BLOCKS * rate * (now - self._credited_at) * 1e-6
        self._credit = min(self._credit, BLOCKS * rate)
        self._credited_at = now
        return self._credit > 0
