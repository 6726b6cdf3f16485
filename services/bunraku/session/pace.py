"""Whether a stage works out every frame, or, where the machine has too much to do, every second."""

from __future__ import annotations

BUSY = 6_000
"""Microseconds that messages are late by, of late: then every second frame is left to the viewers, who show what lies
between two."""
CALM = 1_500
"""Microseconds below which messages are in time again."""
PATIENCE = 300
"""Messages in time before all frames are tried again: some ten seconds."""
_NEWEST = 0.1


class Pace:
    """Of one stage while it is pulled at."""

    def __init__(self) -> None:
        self.full = True
        """Whether every frame is to be worked out."""
        self._late = 0.0
        self._calm = 0

    def late(self, microseconds: int) -> None:
        """A message was late by so much."""
        self._late += _NEWEST * (microseconds - self._late)
        self._calm = self._calm + 1 if self._late < CALM else 0
        if self._late > BUSY:
            self.full = False
        elif self._calm > PATIENCE:
            self.full, self._calm = True, 0
