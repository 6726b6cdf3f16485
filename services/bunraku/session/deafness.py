"""Time in which nobody could be heard, as the process stood still: it is not the silence of those who hold limbs."""

from __future__ import annotations

from bunraku.marionette.ownership import LOST_AFTER

STOOD = LOST_AFTER // 4
"""A message later than this many microseconds is so because nothing went on here."""


class Deafness:
    """Of one stage. Times are clock time in microseconds."""

    def __init__(self) -> None:
        self._deaf = 0
        self._until = 0

    def late(self, microseconds: int, now: int) -> int:
        """A message was late by so much; how much of everyone's silence until `now` is not theirs.

        What was said meanwhile waits at sockets and is heard after some more messages: so time that was lost counts for
        as long as one may be silent.
        """
        before = self._deaf if now < self._until else 0
        if microseconds > STOOD:
            before = self._deaf = before + microseconds
            self._until = now + LOST_AFTER
        return max(microseconds, before, 0)
