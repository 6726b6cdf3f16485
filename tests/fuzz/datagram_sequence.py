"""Fuzzing inputs that are sequences of datagrams or messages, each after its length in two bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterator

LENGTH = struct.Struct(">H")


def split_datagrams(data: bytes) -> Iterator[bytes]:
    """Yield the datagrams of an input."""
    position = 0
    while position + LENGTH.size <= len(data):
        (size,) = LENGTH.unpack_from(data, position)
        position += LENGTH.size
        yield data[position : position + size]
        position += size


def join_datagrams(*datagrams: bytes) -> bytes:
    """Return the input for a sequence of datagrams."""
    return b"".join(LENGTH.pack(len(datagram)) + datagram for datagram in datagrams)
