from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.contact import (
    decode_contact_block,
    encode_contacts,
    pack_contact_block,
    parse_contact_track,
)
from bunraku.codec.extension.track import parse_extension_track
from bunraku.codec.prior import MAX_BLOCK_FRAMES
from bunraku.codec.timing import plan_timing

PLANTED = np.random.default_rng(3).random((100, 2)).round().astype(bool)
ENCODED = encode_contacts(PLANTED, plan_timing(30.0, 100, first_seconds=0.5), performer=2)


@given(st.integers(1, MAX_BLOCK_FRAMES), st.lists(st.integers(0, 2 * MAX_BLOCK_FRAMES), max_size=12))
def test_blocks_round_trip(frames: int, ends: list[int]) -> None:
    bits = np.zeros(2 * frames, dtype=bool)
    for end in ends:
        bits[min(end, 2 * frames) :] ^= True
    planted = bits.reshape(2, frames).T
    np.testing.assert_array_equal(decode_contact_block(pack_contact_block(planted), frames).planted, planted)


@given(st.binary(max_size=12), st.integers(1, MAX_BLOCK_FRAMES))
def test_any_bytes_are_decoded_or_refused(data: bytes, frames: int) -> None:
    try:
        block = decode_contact_block(data, frames)
    except DamagedBlock:
        return
    assert block.planted.shape == (frames, 2)
    assert len(pack_contact_block(block.planted)) <= len(data)


@pytest.mark.parametrize(
    "data", [b"", b"\x1e", b"\x1e\x1f", b"\x1e\x1e\x00", b"\x00\x00\x1e\x1e", b"\x0a\x00\x14\x1e", b"\x1e\x9e"]
)
def test_invalid_block_is_refused(data: bytes) -> None:
    with pytest.raises(DamagedBlock):
        decode_contact_block(data, 30)


def test_track_round_trips_with_the_blocks_of_its_motion() -> None:
    description = ENCODED.describe()
    track = parse_contact_track(description)
    assert (track, track.performer, description["part"]) == (ENCODED.track, 2, "contacts")
    decoded = [
        decode_contact_block(block, track.frames_in(index)).planted
        for index, block in enumerate(ENCODED.ladder[0].blocks)
    ]
    np.testing.assert_array_equal(np.concatenate(decoded), PLANTED)


@pytest.mark.parametrize(
    "change",
    [
        {"codec": "bunraku.contact/9"},
        {"performer": -1},
        {"performer": "0"},
        {"performer": True},
        {"frames": 0},
        {"fps": "30"},
    ],
)
def test_invalid_description_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(DamagedBlock):
        parse_contact_track(ENCODED.describe() | change)


def test_decoder_of_joints_refuses_contacts() -> None:
    with pytest.raises(DamagedBlock, match="contacts"):
        parse_extension_track(ENCODED.describe())
