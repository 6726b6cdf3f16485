"""ArtDmx packets: levels of one universe over Art-Net 4 (art-net.org.uk, "ArtDmx packet definition")."""

from __future__ import annotations

import struct

DEFAULT_PORT = 6454
MAX_UNIVERSE = 0x7FFF
"""Largest Port-Address: net (7 bits), sub-net (4) and universe (4)."""

_HEADER = struct.Struct("<8sH")
_FIELDS = struct.Struct(">HBBBBH")
_OP_DMX = 0x5000
_PROTOCOL_VERSION = 14


def pack_artdmx(universe: int, sequence: int, levels: bytes) -> bytes:
    """Return the packet with `levels`, an even number of 2 to 512 bytes, for a Port-Address 0..32767.

    `sequence` counts packets; it is mapped to 1..255, because 0 turns the receiver's check of the order off.
    """
    if not 0 <= universe <= MAX_UNIVERSE:
        raise ValueError(f"an Art-Net universe is 0..{MAX_UNIVERSE}, not {universe}")
    if len(levels) % 2 or not 2 <= len(levels) <= 512:
        raise ValueError(f"an ArtDmx packet has an even number of 2..512 levels, not {len(levels)}")
    header = _HEADER.pack(b"Art-Net\0", _OP_DMX)
    fields = _FIELDS.pack(_PROTOCOL_VERSION, sequence % 255 + 1, 0, universe & 0xFF, universe >> 8, len(levels))
    return header + fields + levels
