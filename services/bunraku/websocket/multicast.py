"""Outlets to which the same bytes are written at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from bunraku.websocket.connection import WebSocketConnection

MAX_UNCOMPILED_GROUP = 8
"""Of so few a loop in Python is as quick."""

_compiled_modules: list[Any] = []


@cache
def warm_up() -> None:
    """Load what writes to many at once; takes seconds, and is done without before. Can be called in a thread."""
    try:
        from bunraku.websocket import multicast_send
    except (ImportError, AttributeError):
        # a system whose sockets are something else
        return
    _compiled_modules.append(multicast_send)


class MulticastGroup:
    """Some outlets, all of them `clear`; of no use once one of them is not."""

    __slots__ = ("_connections", "_file_descriptors", "_sent_bytes", "_write_methods")

    def __init__(self, connections: Sequence[WebSocketConnection]) -> None:
        numbers = [outlet.file_descriptor for outlet in connections]
        plain = bool(_compiled_modules) and len(connections) > MAX_UNCOMPILED_GROUP and None not in numbers
        self._connections = connections
        self._file_descriptors = np.array(numbers, np.int32) if plain else None
        self._sent_bytes = np.empty(len(connections) if plain else 0, np.int64)
        self._write_methods: list[Callable[[bytes], None]] = [] if plain else [outlet.write for outlet in connections]

    def __len__(self) -> int:
        """How many there are."""
        return len(self._connections)

    def write(self, data: bytes) -> int:
        """Write to each; what a socket has no room for waits in its transport, as `Outlet.write` has it. The answer is
        how many bytes went without that."""
        if self._file_descriptors is None:
            for write in self._write_methods:
                write(data)
            return 0
        went = len(self._connections) * len(data)
        library = _compiled_modules[0]
        if library.multicast_send(
            self._file_descriptors, np.frombuffer(data, np.uint8), library.SEND_FLAGS, self._sent_bytes
        ):
            for place in np.flatnonzero(self._sent_bytes != len(data)).tolist():
                # one that is broken finds out by itself
                left = data[max(int(self._sent_bytes[place]), 0) :]
                went -= len(left)
                self._connections[place].write(left)
        return went
