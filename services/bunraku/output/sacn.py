"""E1.31 data packets: levels of one universe over streaming ACN (ANSI E1.31-2018, tables 4-1 to 7-1)."""

from __future__ import annotations

import struct

DEFAULT_PORT = 5568
MIN_UNIVERSE, MAX_UNIVERSE = 1, 63_999
MAX_PRIORITY = 200
DEFAULT_PRIORITY = 100
TERMINATION_PACKETS = 3
"""Packets with the option Stream_Terminated at the end of a stream (6.2.6)."""

_ROOT_LAYER = struct.Struct(">HH12sHI16s")
_FRAMING_LAYER = struct.Struct(">HI64sBHBBH")
_DMP_LAYER = struct.Struct(">HBBHHH")
_PREAMBLE_BYTES = 0x0010
_PACKET_IDENTIFIER = b"ASC-E1.17\0\0\0"
_VECTOR_ROOT_E131_DATA = 0x0000_0004
_VECTOR_E131_DATA_PACKET = 0x0000_0002
_VECTOR_DMP_SET_PROPERTY = 0x02
_ADDRESS_AND_DATA_TYPE = 0xA1
_FLAGS = 0x7000
_STREAM_TERMINATED = 0x40
_NULL_START_CODE = b"\0"
_MAX_NAME_BYTES = 63


def pack_data(
    universe: int,
    sequence: int,
    levels: bytes,
    *,
    cid: bytes,
    source: str,
    priority: int = DEFAULT_PRIORITY,
    terminated: bool = False,
) -> bytes:
    """Return the packet with `levels`, at most 512 bytes, for a universe 1..63999.

    Args:
        universe: Number of the universe.
        sequence: Counter of the packets of this universe, taken modulo 256.
        levels: Levels from slot 1 on.
        cid: Identifier of the sender, the 16 bytes of a UUID, the same for all its packets (5.6).
        source: Name of the sender that consoles show.
        priority: 0..200; receivers use the source with the highest one (6.2.3).
        terminated: Announce the end of the stream, so that receivers do not wait for a timeout (6.2.6).
    """
    if not MIN_UNIVERSE <= universe <= MAX_UNIVERSE:
        raise ValueError(f"an sACN universe is {MIN_UNIVERSE}..{MAX_UNIVERSE}, not {universe}")
    if not 0 <= priority <= MAX_PRIORITY:
        raise ValueError(f"an sACN priority is 0..{MAX_PRIORITY}, not {priority}")
    if len(levels) > 512 or len(cid) != 16:
        raise ValueError(f"an E1.31 packet has at most 512 levels and a CID of 16 bytes, not {len(levels)}, {len(cid)}")
    values = _NULL_START_CODE + levels
    # a length counts from its own field to the end of the packet
    dmp = _DMP_LAYER.size + len(values)
    framing = _FRAMING_LAYER.size + dmp
    root = _ROOT_LAYER.size - 16 + framing
    name = source.encode()[:_MAX_NAME_BYTES].decode(errors="ignore").encode()
    options = _STREAM_TERMINATED if terminated else 0
    return b"".join(
        (
            _ROOT_LAYER.pack(_PREAMBLE_BYTES, 0, _PACKET_IDENTIFIER, _FLAGS | root, _VECTOR_ROOT_E131_DATA, cid),
            _FRAMING_LAYER.pack(
                _FLAGS | framing, _VECTOR_E131_DATA_PACKET, name, priority, 0, sequence % 256, options, universe
            ),
            _DMP_LAYER.pack(_FLAGS | dmp, _VECTOR_DMP_SET_PROPERTY, _ADDRESS_AND_DATA_TYPE, 0, 1, len(values)),
            values,
        )
    )


def multicast_address(universe: int) -> str:
    """Return the IPv4 multicast address of a universe (9.3.1): 239.255 and its two bytes."""
    return f"239.255.{universe >> 8}.{universe & 0xFF}"
