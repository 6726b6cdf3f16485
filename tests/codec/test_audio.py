from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.audio import (
    AUDIO_CODEC,
    PACKET_SAMPLES,
    SAMPLE_RATE,
    EncodedAudio,
    create_audio_track,
    max_samples,
    pack_audio_block,
    pack_audio_level,
    packet_duration_ms,
    parse_audio_track,
    unpack_audio_block,
)
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, plan_timing
from tests.vectors.audio import PACKET_PREFIXES, random_packets

TIMING = plan_timing(30.0, 100, first_seconds=0.5)

timings = st.builds(
    plan_timing,
    st.floats(1.0, 1000.0) | st.sampled_from([24.0, 29.97, 30.0, 59.94, 60.0, 120.0, 128.0]),
    st.integers(1, 600),
    st.floats(0.02, 2.0),
    st.none() | st.floats(0.01, 1.0),
)


@given(
    st.integers(0, (1 << 28) - 8),
    st.lists(st.tuples(st.sampled_from(PACKET_PREFIXES), st.binary(max_size=400)), max_size=7),
)
def test_packets_come_back(first: int, parts: list[tuple[bytes, bytes]]) -> None:
    sent = [head + rest for head, rest in parts]
    block = pack_audio_block(first, sent)
    assert unpack_audio_block(block) == [(first + n, packet) for n, packet in enumerate(sent)]
    assert len(block) <= sum(map(len, sent)) + 2 * len(sent) + 4


@given(timings, st.floats(0.001, 1.0), st.integers(0, 400))
def test_every_packet_is_in_the_block_in_which_it_starts(timing: Timing, share: float, pre_skip: int) -> None:
    samples = max(1, round(max_samples(timing) * share))
    track = create_audio_track(timing, 2, pre_skip, samples)
    sent = random_packets(track.packet_count, 20, 1)
    rate = pack_audio_level(track, sent)
    assert len(rate.blocks) == timing.block_count
    found = [(index, packet) for index, block in enumerate(rate.blocks) for packet in unpack_audio_block(block)]
    assert [packet for _, packet in found] == list(enumerate(sent))
    for index, packet in found:
        start = track.first_sample(packet.number) * 1e6 / SAMPLE_RATE
        assert index == 0 or timing.start_us(index) <= start + 1
        assert index == timing.block_count - 1 or start < timing.start_us(index + 1)
    # all that sounds is in packets, and no packet is for nothing
    assert track.first_sample(len(sent)) >= samples > track.first_sample(len(sent) - 1)


@given(st.binary(max_size=60))
def test_what_is_no_block_is_refused(data: bytes) -> None:
    try:
        found = unpack_audio_block(data)
    except DamagedBlock:
        return
    assert all(packet_duration_ms(packet.data) == 60 for packet in found)
    assert found or not data


def test_how_long_a_packet_sounds_is_told_by_its_first_bytes() -> None:
    known = {
        b"\x00": 10, b"\x08": 20, b"\x10": 40, b"\x18": 60, b"\x19": 120, b"\x60": 10, b"\x68": 20, b"\x80": 2.5,
        b"\x98": 20, b"\x99": 40, b"\x9b\x03": 60, b"\x83\x18": 60, b"\xff": 0, b"\xff\x00": 0,
    }  # fmt: skip
    assert {packet: packet_duration_ms(packet) for packet in known} == known


def test_packets_that_are_no_track_are_not_put_in_blocks() -> None:
    track = create_audio_track(TIMING, 1, 120, 48_000)
    with pytest.raises(ValueError, match="17 packets, not 16"):
        pack_audio_level(track, random_packets(16, 9, 1))
    with pytest.raises(DamagedBlock, match="20 ms"):
        pack_audio_level(track, [b"\x08a"] * 17)


def test_what_a_description_says_is_read_back() -> None:
    track = create_audio_track(TIMING, 2, 120, 100_000)
    described = EncodedAudio(track, [pack_audio_level(track, random_packets(track.packet_count, 90, 2))]).describe()
    assert parse_audio_track(described, TIMING) == track
    assert described["codec"] == AUDIO_CODEC
    assert [track.start_us(n) for n in range(track.block_count)] == [
        TIMING.start_us(n) for n in range(TIMING.block_count)
    ]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"codec": "opus"}, "'opus'"),
        ({"channels": 3}, "channels"),
        ({"channels": None}, "channels"),
        ({"pre_skip": -1}, "pre_skip"),
        ({"pre_skip": 2 * PACKET_SAMPLES + 1}, "pre_skip"),
        ({"samples": 0}, "samples"),
        ({"samples": 1 << 60}, "samples"),
        ({"rates": []}, "rates"),
        ({"rates": [{"kbps": "8"}]}, "kbps"),
        ({"rates": [8]}, "kbps"),
    ],
)
def test_another_description_is_refused(change: dict[str, Any], says: str) -> None:
    track = create_audio_track(TIMING, 2, 120, 100_000)
    described = EncodedAudio(track, [pack_audio_level(track, random_packets(track.packet_count, 90, 2))]).describe()
    with pytest.raises(DamagedBlock, match=says):
        parse_audio_track(described | change, TIMING)
