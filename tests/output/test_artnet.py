from __future__ import annotations

import struct

import pytest

from bunraku.output.artnet import pack_artdmx


def test_packet_has_the_fields_of_the_specification() -> None:
    levels = bytes(range(256)) * 2
    packet = pack_artdmx(0x1234, 0, levels)
    assert packet[:8] == b"Art-Net\0"
    assert struct.unpack_from("<H", packet, 8) == (0x5000,)
    version, sequence, physical, sub_universe, net, length = struct.unpack_from(">HBBBBH", packet, 10)
    assert (version, sequence, physical) == (14, 1, 0)
    assert (net << 8) + sub_universe == 0x1234
    assert packet[18:] == levels
    assert length == 512


def test_sequence_leaves_out_zero() -> None:
    sequences = [pack_artdmx(0, count, b"\0\0")[12] for count in range(512)]
    assert sequences == [*range(1, 256), *range(1, 256), 1, 2]


@pytest.mark.parametrize(("universe", "levels"), [(-1, 2), (1 << 15, 2), (0, 0), (0, 3), (0, 514)])
def test_invalid_packets_are_rejected(universe: int, levels: int) -> None:
    with pytest.raises(ValueError, match="Art"):
        pack_artdmx(universe, 0, bytes(levels))
