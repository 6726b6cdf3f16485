"""A line in virtual time for tests: a transmitter with a rate, a fixed delay, and a receiver that acknowledges as TCP
does: once there are more than 536 bytes, or after 60 ms. Times are microseconds, rates bytes a second."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from bunraku.playout.window import on_line

DELAYED = 60_000
"""A receiver waits so long for more before it acknowledges."""
SEGMENT = 536
"""As many bytes are acknowledged at once."""


class VirtualLine:
    """One way of a line, and the acknowledgements that come back."""

    def __init__(self, rate_at: Callable[[int], float], delay: int) -> None:
        """`rate_at` tells the rate at an instant, bytes of the line a second; `delay` is one way."""
        self._rate_at = rate_at
        self._delay = delay
        self._idle_at = 0.0
        self._written = 0
        # of each packet: when it arrives, and bytes written up to its end
        self._arriving: deque[tuple[float, int]] = deque()
        self._heard: deque[tuple[float, int]] = deque()
        self._unanswered: list[tuple[float, int]] = []
        self._answered = 0
        self._acknowledged = 0
        self.carried = 0

    def write(self, at: int, size: int) -> float:
        """A message of `size` bytes goes; when it arrives."""
        start = max(float(at), self._idle_at)
        self._idle_at = start + on_line(size) / self._rate_at(int(start)) * 1e6
        self._written += size
        self.carried += on_line(size)
        arrives = self._idle_at + self._delay
        self._arriving.append((arrives, self._written))
        return arrives

    def waiting(self, at: int) -> int:
        """Bytes written that are not acknowledged at `at`, as the sender's system knows it."""
        while self._arriving and self._arriving[0][0] <= at:
            came, end = self._arriving.popleft()
            self._timer(came)
            self._unanswered.append((came, end))
            if end - self._answered > SEGMENT:
                self._answer(came, end)
        self._timer(at)
        while self._heard and self._heard[0][0] <= at:
            self._acknowledged = self._heard.popleft()[1]
        return self._written - self._acknowledged

    def _timer(self, at: float) -> None:
        if self._unanswered and self._unanswered[0][0] + DELAYED <= at:
            self._answer(self._unanswered[0][0] + DELAYED, self._unanswered[-1][1])

    def _answer(self, at: float, end: int) -> None:
        self._heard.append((at + self._delay, end))
        self._answered = end
        self._unanswered.clear()
