"""A flow over a virtual line."""

from __future__ import annotations

from bunraku.backing.line import Reading
from bunraku.stream.flow import Flow
from tests.playout.virtual_line import VirtualLine


class Sender:
    """A flow over a virtual line, and its time."""

    def __init__(self, rate: float, delay: int) -> None:
        self.at = 0
        self.reads = 0
        self.slow: float | None = None
        self.written = 0
        self.line = VirtualLine(lambda _: self.slow or rate, delay)
        self.round_trip = 2 * delay
        self.closed = False
        self.made_plain = False
        self.flow = Flow(self, lambda: self.at)

    def read(self) -> Reading:
        self.reads += 1
        if self.closed:
            raise OSError("closed")
        return Reading(self.line.waiting(self.at), self.round_trip, self.round_trip, self.written)

    def asking(self, _: int) -> bytes:
        return b""

    def echoed(self, payload: bytes) -> None: ...

    def hold(self, held: bool) -> None:
        assert not held

    def plain(self) -> None:
        self.made_plain = True

    def write(self, size: int) -> None:
        self.write_untold(size)
        self.flow.wrote(size)

    def write_untold(self, size: int) -> None:
        self.line.write(self.at, size)
        self.written += size
