"""Golden audio blocks are read and written unchanged, and invalid ones are refused."""

from __future__ import annotations

import base64

import pytest

from bunraku.codec.audio import pack_audio_block, parse_audio_track, unpack_audio_block
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import parse_timing
from tests.vectors.test_golden import committed


def test_golden_audio_blocks_read_and_write_unchanged() -> None:
    ours = committed("audio.json")
    tracks = [
        parse_audio_track(track, parse_timing(motion, "motion"))
        for track, motion in zip(ours["tracks"], ours["motions"], strict=True)
    ]
    for valid in ours["valid"]:
        block = base64.b64decode(valid["block"])
        packets = unpack_audio_block(block)
        decoded = [
            {"number": number, "sample": tracks[valid["track"]].first_sample(number), "data": data}
            for number, data in packets
        ]
        assert decoded == [packet | {"data": base64.b64decode(packet["data"])} for packet in valid["packets"]]
        assert all(tracks[valid["track"]].block_of_packet(packet.number) == valid["index"] for packet in packets)
        assert pack_audio_block(packets[0].number if packets else 0, [packet.data for packet in packets]) == block


def test_invalid_audio_blocks_are_refused() -> None:
    for invalid in committed("audio.json")["invalid"]:
        with pytest.raises(DamagedBlock):
            unpack_audio_block(base64.b64decode(invalid["block"]))
