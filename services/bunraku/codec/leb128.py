"""Integers of one to four bytes in LEB128 (proto/codec.md, 2.15)."""

from __future__ import annotations

from bunraku.codec.errors import DamagedBlock


def encode_leb128(value: int) -> bytes:
    """Return the bytes of an integer, 0 .. 2^28 - 1."""
    low = []
    while value >> 7:
        low.append(value & 127 | 128)
        value >>= 7
    return bytes([*low, value])


def decode_leb128(data: bytes, offset: int) -> tuple[int, int]:
    """Return the integer at `offset` and the offset after it. Raises `DamagedBlock` beyond four bytes or the data."""
    value = 0
    for shift in (0, 7, 14, 21):
        if offset == len(data):
            break
        byte, offset = data[offset], offset + 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, offset
    raise DamagedBlock("Invalid block: an integer must have 1 to 4 bytes.")
