from __future__ import annotations

import struct
import uuid

import pytest

from bunraku.output.sacn import multicast_address, pack_data

CID = uuid.UUID("12345678-1234-5678-1234-567812345678").bytes


def test_packet_has_the_fields_of_the_standard() -> None:
    levels = bytes(range(256)) * 2
    packet = pack_data(0x1234, 257, levels, cid=CID, source="Bünraku", priority=120)
    # octets of the tables of E1.31-2018: root layer 0-37, framing layer 38-114, DMP layer 115-637
    assert len(packet) == 638
    assert packet[:16] == b"\x00\x10\x00\x00ASC-E1.17\x00\x00\x00"
    assert struct.unpack_from(">HI", packet, 16) == (0x7000 | 638 - 16, 4)
    assert packet[22:38] == CID
    assert struct.unpack_from(">HI", packet, 38) == (0x7000 | 638 - 38, 2)
    assert packet[44:108].rstrip(b"\0").decode() == "Bünraku"
    assert packet[108] == 120
    assert packet[109:111] == b"\0\0", "not synchronised"
    assert packet[111] == 1
    assert packet[112] == 0
    assert struct.unpack_from(">H", packet, 113) == (0x1234,)
    assert struct.unpack_from(">HBBHHH", packet, 115) == (0x7000 | 638 - 115, 2, 0xA1, 0, 1, 513)
    assert packet[125] == 0, "null start code"
    assert packet[126:] == levels


def test_end_of_the_stream_is_an_option() -> None:
    assert pack_data(1, 0, bytes(512), cid=CID, source="", terminated=True)[112] == 0x40


def test_long_name_is_cut_between_characters() -> None:
    name = pack_data(1, 0, b"", cid=CID, source="人形" * 20)[44:108]
    assert name.endswith(b"\0")
    assert name.rstrip(b"\0").decode() == ("人形" * 20)[:21]


def test_multicast_address_has_the_universe() -> None:
    assert multicast_address(1) == "239.255.0.1"
    assert multicast_address(63_999) == "239.255.249.255"


@pytest.mark.parametrize(
    ("universe", "priority", "levels", "cid", "text"),
    [
        (0, 100, 512, CID, "universe"),
        (64_000, 100, 512, CID, "universe"),
        (1, 201, 512, CID, "priority"),
        (1, 100, 513, CID, "512"),
        (1, 100, 512, CID[1:], "CID"),
    ],
)
def test_invalid_packets_are_rejected(universe: int, priority: int, levels: int, cid: bytes, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        pack_data(universe, 0, bytes(levels), cid=cid, source="Bunraku", priority=priority)
