"""Writing one message to a group of connections."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Protocol

import numpy as np

from bunraku.kernels import load_kernels
from bunraku.websocket.connection import WebSocketConnection

MAX_PLAIN_GROUP = 8
"""Largest group for which a loop in Python is as fast as the compiled one."""

GroupWriter = Callable[[bytes], int]
"""Writes a message to every connection of a group; returns the number of bytes that it sent without a transport."""


class MulticastSender(Protocol):
    """Way of writing one message to many connections."""

    def bind(self, connections: Sequence[WebSocketConnection]) -> GroupWriter:
        """Return the writer for these connections. All of them must be writable."""


class PlainSender:
    """Sender that calls the transport of each connection."""

    def bind(self, connections: Sequence[WebSocketConnection]) -> GroupWriter:
        writes = [connection.write for connection in connections]

        def write_to_all(data: bytes) -> int:
            for write in writes:
                write(data)
            return 0

        return write_to_all


PLAIN_SENDER = PlainSender()


class CompiledSender:
    """Sender that calls send(2) for all connections in one compiled loop.

    Small groups, and groups with an encrypted connection, are written by `PlainSender`.
    """

    def __init__(self, kernels: ModuleType) -> None:
        """`kernels` is the result of `load_kernels("websocket")`."""
        self._multicast_send: Callable[..., int] = kernels.multicast_send
        self._flags: int = kernels.SEND_FLAGS

    def bind(self, connections: Sequence[WebSocketConnection]) -> GroupWriter:
        descriptors = [connection.file_descriptor for connection in connections]
        if len(connections) <= MAX_PLAIN_GROUP or None in descriptors:
            return PLAIN_SENDER.bind(connections)
        file_descriptors = np.array(descriptors, np.int32)
        sent = np.empty(len(connections), np.int64)
        multicast_send, flags = self._multicast_send, self._flags

        def write_to_all(data: bytes) -> int:
            size = len(data)
            total = len(connections) * size
            if multicast_send(file_descriptors, np.frombuffer(data, np.uint8), flags, sent):
                for index in np.flatnonzero(sent != size).tolist():
                    # the transport buffers the rest; that of a broken connection notices the error by itself
                    rest = data[max(int(sent[index]), 0) :]
                    total -= len(rest)
                    connections[index].write(rest)
            return total

        return write_to_all


class LazySender:
    """Plain sender until `load` has completed, compiled sender from then on."""

    def __init__(self) -> None:
        self._sender: MulticastSender = PLAIN_SENDER

    def load(self) -> None:
        """Load the compiled sender. Takes seconds; may be called in a thread.

        The plain sender stays in use on systems without POSIX sockets.
        """
        try:
            self._sender = CompiledSender(load_kernels("websocket"))
        except (ImportError, AttributeError):
            return

    def bind(self, connections: Sequence[WebSocketConnection]) -> GroupWriter:
        return self._sender.bind(connections)


class MulticastGroup:
    """Group of writable connections that receive the same messages. Discard it once a connection is not writable."""

    __slots__ = ("_size", "write")

    def __init__(self, connections: Sequence[WebSocketConnection], sender: MulticastSender) -> None:
        self._size = len(connections)
        self.write: GroupWriter = sender.bind(connections)
        """Write a message to each connection. Bytes that a socket does not accept are buffered by its transport. Return
        the number of bytes that were sent without a transport, which `WebSocketConnection.write` does not count."""

    def __len__(self) -> int:
        return self._size
