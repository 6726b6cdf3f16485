"""Outlets to which the same bytes are written at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from bunraku.backing.outlet import Outlet

FEW = 8
"""Of so few a loop in Python is as quick."""

_compiled: list[Any] = []


@cache
def warm() -> None:
    """Load what writes to many at once; takes seconds, and is done without before. Can be called in a thread."""
    try:
        from bunraku.backing import send_all
    except (ImportError, AttributeError):
        # a system whose sockets are something else
        return
    _compiled.append(send_all)


class Together:
    """Some outlets, all of them `clear`; of no use once one of them is not."""

    __slots__ = ("_numbers", "_outlets", "_sent", "_writes")

    def __init__(self, outlets: Sequence[Outlet]) -> None:
        numbers = [outlet.number for outlet in outlets]
        plain = bool(_compiled) and len(outlets) > FEW and None not in numbers
        self._outlets = outlets
        self._numbers = np.array(numbers, np.int32) if plain else None
        self._sent = np.empty(len(outlets) if plain else 0, np.int64)
        self._writes: list[Callable[[bytes], None]] = [] if plain else [outlet.write for outlet in outlets]

    def __len__(self) -> int:
        """How many there are."""
        return len(self._outlets)

    def write(self, data: bytes) -> int:
        """Write to each; what a socket has no room for waits in its transport, as `Outlet.write` has it. The answer is
        how many bytes went without that."""
        if self._numbers is None:
            for write in self._writes:
                write(data)
            return 0
        went = len(self._outlets) * len(data)
        library = _compiled[0]
        if library.send_all(self._numbers, np.frombuffer(data, np.uint8), library.FLAGS, self._sent):
            for place in np.flatnonzero(self._sent != len(data)).tolist():
                # one that is broken finds out by itself
                left = data[max(int(self._sent[place]), 0) :]
                went -= len(left)
                self._outlets[place].write(left)
        return went
