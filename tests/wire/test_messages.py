from __future__ import annotations

import dataclasses
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.wire import messages
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.live import Sample
from bunraku.wire.messages import (
    Alive,
    Ask,
    Bond,
    BondEnd,
    ChannelHeader,
    Choice,
    Claim,
    Data,
    Description,
    Edit,
    Grant,
    Input,
    Message,
    Notice,
    Ping,
    Pong,
    Presence,
    Problem,
    Pull,
    Put,
    Refusal,
    Release,
    Report,
    TimelineState,
    Welcome,
    unpack,
)
from bunraku.wire.overlay import Overlay

TIME = st.integers(0, (1 << 53) - 1)
U32 = st.integers(0, 0xFFFFFFFF)
LIMB = st.integers(0, MAX_LIMBS - 1)
TEXT = st.text(max_size=20)
SINGLE = st.floats(allow_nan=False, allow_infinity=False, width=32)
I16 = st.integers(-32768, 32767)

MESSAGES: st.SearchStrategy[Any] = st.one_of(
    st.builds(ChannelHeader, motion=TEXT, now=TIME, channels=TIME, software=TEXT),
    st.builds(Description, motion=TEXT, tracks=st.lists(st.dictionaries(TEXT, st.binary(max_size=9)), max_size=2)),
    st.builds(
        Data, track=st.integers(0, 15), rate=st.integers(0, 15), index=st.integers(0, (1 << 21) - 1), block=st.binary()
    ),
    st.builds(
        TimelineState,
        epoch=TIME,
        motion=TEXT,
        clock=TIME,
        position=TIME,
        playing=st.booleans(),
        loop=st.booleans(),
        duration=TIME,
    ),
    st.builds(
        Overlay,
        sequence=st.integers(0, 0xFFFF),
        due=TIME,
        limbs=st.dictionaries(LIMB, st.tuples(*[I16] * 9)),
    ),
    st.builds(
        Presence,
        viewers=TIME,
        puppeteers=st.lists(st.dictionaries(TEXT, TEXT), max_size=3),
        limbs=st.lists(st.none() | TEXT, min_size=4, max_size=4),
        asks=st.just([]) | st.lists(st.lists(TEXT, max_size=3), min_size=4, max_size=4),
        live=st.none() | st.lists(st.dictionaries(TEXT, TEXT), min_size=1, max_size=4),
    ),
    st.builds(Ping, sequence=U32, sent=TIME),
    st.builds(Pong, sequence=U32, sent=TIME, received=TIME, answered=TIME),
    st.builds(Problem, title=TEXT, detail=TEXT),
    st.builds(Welcome, id=TEXT, colour=st.integers(0, 4), lead=TIME),
    st.builds(Grant, limb=LIMB, epoch=U32),
    st.builds(Refusal, limb=LIMB, reason=TEXT, holder=st.none() | TEXT),
    st.builds(Edit, playing=st.none() | st.booleans(), position=st.none() | TIME, loop=st.none() | st.booleans()),
    st.builds(Report, buffer=TIME, decode=TIME, frame=TIME, hidden=st.booleans()),
    st.builds(Claim, limb=LIMB),
    st.builds(Release, limb=LIMB, epoch=U32),
    st.builds(Alive, limbs=st.lists(LIMB, max_size=4)),
    st.builds(Choice, rate=TIME, reason=TEXT, line=st.none() | TIME),
    st.builds(Notice, limb=LIMB, reason=TEXT, detail=TEXT),
    st.builds(Ask, limb=LIMB, wanted=st.booleans()),
    st.builds(Bond, limbs=st.lists(LIMB, min_size=2, max_size=2), wanted=st.booleans()),
    st.builds(BondEnd, limbs=st.lists(LIMB, min_size=2, max_size=2), reason=st.text(max_size=8)),
    st.builds(
        Input,
        limb=LIMB,
        kind=st.integers(0, 1),
        epoch=U32,
        sequence=U32,
        sampled=TIME,
        values=st.tuples(SINGLE, SINGLE, SINGLE),
    ),
)


@given(MESSAGES)
def test_packed_message_unpacks_to_the_same_message(message: Message) -> None:
    assert unpack(message.pack()) == message


@given(st.binary(max_size=80))
def test_arbitrary_bytes_are_decoded_skipped_or_malformed(data: bytes) -> None:
    try:
        message = unpack(data)
    except MalformedMessage:
        return
    assert message is None or dataclasses.is_dataclass(message)


@given(MESSAGES, st.integers(0, 60), st.integers(0, 255))
def test_damaged_message_raises_only_malformed_message(message: Message, at: int, byte: int) -> None:
    data = bytearray(message.pack())
    data[at % len(data)] = byte
    for damaged in (bytes(data), bytes(data[: at % len(data)])):
        try:
            unpack(damaged)
        except MalformedMessage:
            continue


def test_unknown_types_and_unknown_keys_are_skipped() -> None:
    assert unpack(b"\x3fwhatever") is None
    assert unpack(_pack_map(67, {"limb": 2, "news": [1]})) == Claim(2)


def test_packed_sizes_are_those_of_the_contract() -> None:
    assert [len(Data(0, 3, index, b"").pack()) for index in (0, 127, 128, 86_399)] == [3, 3, 4, 5]
    assert len(Overlay(1, 2, {0: (0,) * 9, 3: (1,) * 9}).pack()) == 12 + 36
    assert len(Overlay(1, 2, {0: (0,) * 9}, ({0: (1,) * 9},)).pack()) == 12 + 36
    assert len(Overlay(1, 2, {0: (0,) * 9, 7: (1,) * 9}).pack()) == 14 + 36
    assert len(Ping(1, 2).pack()) == len(Pong(1, 2, 3, 4).pack()) == len(Input(0, 0, 1, 1, 1, (0, 0, 0)).pack()) == 32


def _pack_map(message_type: int, values: Any) -> bytes:
    packed: bytes = msgpack.packb(values)
    return bytes([message_type]) + packed


@pytest.mark.parametrize(
    ("data", "detail"),
    [
        (b"", "message is empty"),
        (_pack_map(67, {"limb": 16}), "limb"),
        (_pack_map(67, {"limb": "left"}), "limb"),
        (_pack_map(67, {"limb": 1.0}), "limb"),
        (_pack_map(67, {"limb": None}), "limb"),
        (_pack_map(67, [1]), "type 67"),
        (_pack_map(67, {"limb": 1}) + b"\0", "extra data"),
        (_pack_map(67, {1: 1, "limb": 1}), "type 67"),
        (bytes([67]) + b"\xc1", "MessagePack"),
        (_pack_map(71, {"limb": 1, "wanted": 1}), "wanted"),
        (_pack_map(65, {"playing": "true"}), "playing"),
        (_pack_map(66, {"buffer": 1, "hidden": 1}), "hidden"),
        (_pack_map(8, {"title": b"title", "detail": "detail"}), "title"),
        (_pack_map(6, {"viewers": 0, "puppeteers": [], "limbs": [None] * 4, "asks": [[]] * 3}), "3 lists"),
        (bytes([70]) + b"\0" * 30, "32 bytes"),
        (Input(0, 1, 1, 1, 1, (float("nan"), 0, 0)).pack(), "finite"),
        (Input(0, 1, 1, 1, 1, (float("inf"), 0, 0)).pack(), "finite"),
        (bytes([5, 0x11]) + bytes(28), "48 bytes"),
        (bytes([5, 1]) + bytes(5), "12 bytes"),
        (bytes([5, 1]) + bytes(10), "30 bytes"),
        (bytes([14, 0]) + bytes(11), "14 bytes"),
        (bytes([14, 0]) + bytes(10) + b"\x10\x80" + bytes(18), "50 bytes"),
        (bytes([70, 16]) + bytes(30), "limb 16"),
    ],
)
def test_malformed_message_error_names_the_fault(data: bytes, detail: str) -> None:
    with pytest.raises(MalformedMessage, match=detail):
        unpack(data)


def test_reserved_bits_and_bytes_are_ignored() -> None:
    for message in (Ping(1, 2), Input(0, 1, 1, 1, 1, (0, 0, 0)), Overlay(1, 2, {5: (0,) * 9})):
        data = bytearray(message.pack())
        if isinstance(message, Overlay):
            data[1] |= 15
        else:
            data[3] = 255
        assert unpack(bytes(data)) == message


def test_block_index_in_more_bytes_than_needed_is_accepted() -> None:
    assert unpack(bytes([3, 0x21, 0x85, 0x80, 0])) == Data(2, 1, 5, b"")


def test_lowest_overlay_number_is_accepted() -> None:
    lowest = Overlay(1, 2, {0: (-32_768,) * 9})
    assert unpack(lowest.pack()) == lowest


def test_types_are_unique_and_client_types_start_at_64() -> None:
    types = [kind.TYPE for kind in messages.Message.__args__]
    assert len(set(types)) == len(types)
    client = {Ping, Edit, Report, Claim, Release, Alive, Ask, Bond, Pull, Put, Input, Sample}
    assert {kind for kind in messages.Message.__args__ if kind.TYPE >= 64} == client
    assert {*messages.FIXED_MESSAGES, *messages.MAP_MESSAGES} == set(messages.Message.__args__)
