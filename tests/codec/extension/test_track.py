from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.body_joints import pack_body, unpack_body
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.track import (
    ExtensionTrack,
    decode_extension_block,
    parse_extension_track,
)
from bunraku.motion.analysis import analyse
from tests.motion.extended_source import extended_source
from tests.motion.test_extension import still_extension

ANALYSIS = analyse(extended_source())
assert ANALYSIS.extension is not None
EXTENSION = ANALYSIS.extension.extension
TRACK = ExtensionTrack(30.0, 120, 30, 15, 0, EXTENSION)
ENCODED = encode_extension(EXTENSION, ANALYSIS.extension.values, TRACK, [4.0, 0.5])


def test_description_round_trips() -> None:
    track = parse_extension_track(ENCODED.describe())
    assert (track.fps, track.frames, track.performer) == (30.0, 120, 0)
    for name in ("offsets", "ends", "drive", "rest"):
        np.testing.assert_allclose(getattr(track.extension, name), getattr(EXTENSION, name), atol=1e-12)
    np.testing.assert_allclose(track.weights, ENCODED.track.weights, atol=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        {"codec": "bunraku.extension/9"},
        {"part": "tail"},
        {"performer": -1},
        {"performer": "0"},
        {"performer": True},
        {"joints": "text"},
        {"joints": b""},
        {"joints": bytes([0]) + bytes(18)},
        {"joints": bytes([5]) + bytes(18)},
        {"joints": bytes([33]) + bytes(18)},
        {"joints": pack_body(EXTENSION) + bytes(512)},
        {"joints": pack_body(EXTENSION)[:1] + bytes(40)},
        {"frames": 0},
    ],
)
def test_invalid_description_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(DamagedBlock):
        parse_extension_track(ENCODED.describe() | change)


@given(st.integers(0, 4), st.booleans(), st.booleans())
def test_joints_round_trip(spine_count: int, has_neck: bool, has_clavicles: bool) -> None:
    if not (spine_count or has_neck or has_clavicles):
        return
    extension = still_extension(spine_count, has_neck, has_clavicles)
    unpacked = unpack_body(pack_body(extension))
    assert unpacked.names == extension.names
    np.testing.assert_allclose(unpacked.offsets, extension.offsets, atol=1e-12)
    assert np.isfinite(ExtensionTrack(30.0, 30, 30, 30, 0, unpacked).inverse_weights).all()


@given(st.binary(max_size=200))
def test_damaged_block_gives_finite_values_or_is_refused(data: bytes) -> None:
    try:
        block = decode_extension_block(TRACK, data)
    except DamagedBlock:
        return
    assert np.isfinite(block.values_at(np.array([0.0, block.frames - 0.5]))).all()


def test_joint_without_length_has_a_weight() -> None:
    flat = replace(still_extension(1), offsets=np.zeros((4, 3)), ends=np.zeros((3, 3)))
    assert np.isfinite(ExtensionTrack(30.0, 30, 30, 30, 0, flat).inverse_weights).all()
