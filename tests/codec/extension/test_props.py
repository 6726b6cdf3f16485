from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.props import (
    ShownState,
    decode_prop_block,
    encode_props,
    pack_prop_block,
    parse_prop_track,
    shift_limb,
)
from bunraku.codec.extension.track import parse_extension_track
from bunraku.codec.prior import MAX_BLOCK_FRAMES
from bunraku.codec.timing import plan_timing
from bunraku.motion.placement import Placement
from bunraku.wire.prop import PropState

ON_FLOOR = PropState(None, Placement(0.5, -2.25, 1.5))
SHOWN: list[list[ShownState]] = [
    [None] * 20 + [ON_FLOOR] * 30 + [PropState(1)] * 50,
    [PropState(5)] * 100,
    [*([PropState(0), PropState(4)] * 50)],
]
ENCODED = encode_props(["fan", "ball", "later"], SHOWN, plan_timing(30.0, 100, first_seconds=0.5), performer=1)

COORDINATES = st.floats(-100, 100, width=32)
STATES = st.one_of(
    st.none(),
    st.sampled_from([PropState(limb) for limb in (0, 1, 4, 5, 8, 9, 12, 13)]),
    st.builds(
        lambda x, z, turn: PropState(None, Placement(x, z, turn)), COORDINATES, COORDINATES, st.floats(-4, 4, width=32)
    ),
)


@given(st.lists(st.lists(st.tuples(STATES, st.integers(1, 60)), min_size=1, max_size=6), min_size=1, max_size=8))
def test_blocks_round_trip(runs: list[list[tuple[ShownState, int]]]) -> None:
    frames = min(MAX_BLOCK_FRAMES, *(sum(length for _, length in each) for each in runs))
    states = [tuple([state for state, length in each for _ in range(length)][:frames]) for each in runs]
    assert decode_prop_block(pack_prop_block(states), len(states), frames).states == tuple(states)


@given(st.binary(max_size=40), st.integers(1, 8), st.integers(1, MAX_BLOCK_FRAMES))
def test_any_bytes_are_decoded_or_refused(data: bytes, props: int, frames: int) -> None:
    try:
        block = decode_prop_block(data, props, frames)
    except DamagedBlock:
        return
    assert [len(each) for each in block.states] == [frames] * props
    assert len(pack_prop_block(block.states)) <= len(data)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x1e",
        b"\x1f\x00",
        b"\x00\x00\x1e\x00",
        b"\x1e\x00\x00",
        b"\x1e\x04",
        b"\x1e\x12",
        b"\x1e\x01" + bytes(11),
        b"\x1e\x01" + struct.pack("<3f", 0, float("nan"), 0),
        b"\x1e\x01" + struct.pack("<3f", 100.5, 0, 0),
        b"\x0a\x00\x9e\x00",
    ],
)
def test_invalid_block_is_refused(data: bytes) -> None:
    with pytest.raises(DamagedBlock):
        decode_prop_block(data, 1, 30)


def test_track_round_trips_with_the_blocks_of_its_motion() -> None:
    description = ENCODED.describe()
    track = parse_prop_track(description)
    assert (track, description["part"], description["channels"]) == (ENCODED.track, "props", 3)
    assert (track.performer, track.kinds) == (1, ("fan", "ball", "later"))
    blocks = [
        decode_prop_block(block, 3, track.frames_in(index)).states
        for index, block in enumerate(ENCODED.ladder[0].blocks)
    ]
    decoded = [[state for block in blocks for state in block[prop]] for prop in range(3)]
    assert decoded == SHOWN
    with pytest.raises(DamagedBlock):
        parse_extension_track(description)


@pytest.mark.parametrize(
    "change",
    [
        {"codec": "bunraku.prop/9"},
        {"performer": -1},
        {"performer": True},
        {"kinds": []},
        {"kinds": ["fan"] * 9},
        {"kinds": [1]},
        {"kinds": "fan"},
        {"frames": 0},
    ],
)
def test_invalid_description_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(DamagedBlock):
        parse_prop_track(ENCODED.describe() | change)


def test_prop_that_lies_still_costs_little() -> None:
    still = encode_props(["fan"], [[ON_FLOOR] * 1_800], plan_timing(60.0, 1_800))
    assert still.ladder[0].kbps < 0.15
    assert np.isfinite(still.ladder[0].kbps)


def test_limbs_count_from_those_of_the_performer() -> None:
    assert shift_limb(PropState(1), 2) == PropState(9)
    assert shift_limb(ON_FLOOR, 2) == ON_FLOOR
    assert shift_limb(None, 2) is None
