"""When there is room on one viewer's line, and whose turn it is where the live overlay and blocks share it.

Most lines are quick, and asking the system about each of them for each overlay would cost more than writing it. So a
line that had room many times in a row counts as quick, is written to unasked, and is looked at now and then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bunraku.backing.line import Reading
from bunraku.playout.window import LEAST, PROBE, Window, on_line

CLEAN = 64
"""So many times there was room at once before a line counts as quick."""
FAR = 20_000
"""Round trips that take longer, microseconds, may be those of a narrow line."""
HEAP = 16_384
"""So much may wait on a line that is near: who reads in gulps is not narrow."""
LATE = 100_000
"""So much longer than the least the round trips of a quick line may take: receivers may wait 40 ms to acknowledge."""
BLOCKS = 0.3
"""The share of a narrow line that blocks get beside overlays,"""
SAVED = 0.2
"""and for how many seconds they can save it up: several blocks in a row would keep overlays waiting."""


class Readable(Protocol):
    """A line that can be read, as those of `bunraku.backing.line`."""

    def read(self) -> Reading:
        """How it stands now; raises OSError once it is closed."""

    def asking(self, size: int, /) -> bytes:
        """What is to be written right behind `size` bytes so that it can be read."""

    def echoed(self, payload: bytes) -> None:
        """What was asked has come back."""

    def hold(self, held: bool) -> None:
        """Keep what is written together in packets as full as can be, or let it go."""

    def plain(self) -> None:
        """Have the system hold back no more than it must."""


class Flow:
    """What one viewer's line can take now. `steady` says that it counts as quick: overlays are written to it unasked,
    and need not be told of."""

    __slots__ = (
        "_before", "_clean", "_credit", "_credited_at", "_line", "_net", "_now", "beginning", "far", "steady", "window",
    )  # fmt: skip

    def __init__(self, line: Readable | None, now: Callable[[], int]) -> None:
        """`line` None: nothing is known of it, and there is always room; `now` tells microseconds. Raises OSError for a
        line that is closed already."""
        reading = Reading(0, 0, 0) if line is None else line.read()
        self._line = line
        self._now = now
        self.window = Window()
        # what had been written before the window was told of anything
        self._before = reading.written
        # of what the window was told, how much was written when the net reached far enough
        self._net: int | None = None
        self._clean = 0
        self._credit = 0.0
        self._credited_at = now()
        self.beginning = line is not None
        """Whether what is written is held until the first block is."""
        self.far = reading.round_trip > FAR
        """Whether answers take their time: the line may be a narrow one, or one that stands now and then."""
        self.steady = not self.far
        if self.far and line is not None:
            line.plain()

    @property
    def free(self) -> bool:
        """Whether blocks, too, are written unasked, and none is kept as a net."""
        return self.steady and not self.far

    def begun(self) -> None:
        """The first block was written, or there is none: what was held so far goes, in one packet."""
        if self.beginning and self._line is not None:
            self.beginning = False
            self._line.hold(False)

    def wrote(self, size: int) -> None:
        """Bytes were written, in one go."""
        if self._line is not None and not self.free:
            self.window.wrote(self._now(), size)

    def asking(self, size: int, /) -> bytes:
        """What is to be written right behind `size` bytes, in one go with them; of none before a look."""
        return b"" if self._line is None or (self.free and size) else self._line.asking(size)

    def answered(self, payload: bytes) -> None:
        """The other end has answered a Ping that asked."""
        if self._line is None:
            return
        unknown = self.unknown
        self._line.echoed(payload)
        if unknown and 0 < self._line.read().round_trip <= FAR:
            # it is near, as far as the proxy is
            self.far, self.steady = False, True

    def look(self) -> None:
        """Now and then, and not for each overlay: whether the line still counts as quick, or does again."""
        if self._line is None:
            return
        if not self.steady:
            if not self.far:
                self._count(self.room() and not self.narrow)
            return
        room = self.free or (self.room() and not self.narrow)
        try:
            reading = self._line.read()
        except OSError:
            # it is closed: whoever writes to it is told
            return
        untold = reading.waiting - self.window.flying > (LEAST if self.far else HEAP)
        if untold or not room or reading.round_trip > reading.least + LATE:
            self.steady, self._clean = False, 0
        if untold:
            # it was filled by what the window knows nothing of
            self.window = Window()
            self._net = None if self._net is None else 0
            self.window.wrote(self._now(), reading.waiting)
            self._before = reading.written - reading.waiting

    def quick(self) -> bool:
        """Whether an overlay may be written whole and at once; the system is asked unless the line is `steady`."""
        if self.steady:
            return True
        clean = not self.narrow and self.room()
        self._count(clean)
        return clean

    def _count(self, clean: bool) -> None:
        self._clean = self._clean + 1 if clean else 0
        self.steady = self._clean >= CLEAN

    def room(self, ahead: int = 0) -> bool:
        """Whether something may be written now; `ahead` as of `Window.room`."""
        if self._line is None:
            return True
        now = self._now()
        if self.window.flying or self.steady:
            try:
                reading = self._line.read()
            except OSError:
                # it is closed: whoever writes to it is told
                return True
            # overlays that were written unasked
            self.window.passed(max(reading.written - self._before - self.window.written, 0))
            self.window.acknowledged(now, reading.waiting, reading.least)
        return self.window.room(now, ahead)

    @property
    def narrow(self) -> bool:
        """Whether the line was full of late."""
        return self._line is not None and self.window.narrow(self._now())

    @property
    def slowing(self) -> bool:
        """Whether the line turned out slower than thought just now: what can wait would make it worse."""
        return self._line is not None and self.window.slowing(self._now())

    @property
    def carries(self) -> float | None:
        """Bytes a second of a line that may be a narrow one, None where it is not or nothing is known."""
        rate = self.window.rate
        if rate is None or not (self.far or self.narrow):
            return None
        # as long as it was never full it carries more than it was seen to
        return rate if self.window.full_at is not None else PROBE * rate

    @property
    def unknown(self) -> bool:
        """Whether the line may be narrow: nothing was acknowledged yet."""
        return self.far and self.window.rate is None

    @property
    def learning(self) -> bool:
        """Whether something is on its way that will tell of the line."""
        return self.window.flying > 0 and (self.unknown or (self._net is not None and not self.net_came))

    def net_went(self) -> None:
        """What was written by now is a net that reaches far enough."""
        if self._net is None:
            self._net = self.window.written

    @property
    def net_came(self) -> bool:
        """Whether such a net is at the other end."""
        return self._line is None or (self._net is not None and self.window.came(self._net))

    def block_went(self, size: int) -> None:
        """A block was written."""
        self._credit -= on_line(size)

    def blocks_turn(self) -> bool:
        """Whether a block that can wait may take room from overlays: on a narrow line they have a share of it, but not
        while too much is on its way as it is."""
        now, rate = self._now(), self.window.rate or 0.0
        self._credit += BLOCKS * rate * (now - self._credited_at) * 1e-6
        self._credit = min(self._credit, BLOCKS * rate * SAVED)
        self._credited_at = now
        return self._credit > 0 and not self.slowing
