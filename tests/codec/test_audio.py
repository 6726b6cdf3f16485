from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.audio import (
    AUDIO_CODEC,
    MAX_PRE_SKIP_SAMPLES,
    PACKET_SAMPLES,
    SAMPLE_RATE,
    EncodedAudio,
    create_audio_track,
    cut_audio,
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
def test_packets_round_trip(first: int, parts: list[tuple[bytes, bytes]]) -> None:
    packets = [prefix + rest for prefix, rest in parts]
    block = pack_audio_block(first, packets)
    assert unpack_audio_block(block) == [(first + n, packet) for n, packet in enumerate(packets)]
    assert len(block) <= sum(map(len, packets)) + 2 * len(packets) + 4


@given(timings, st.floats(0.001, 1.0), st.integers(0, 400))
def test_packet_is_in_the_block_in_which_it_starts(timing: Timing, share: float, pre_skip: int) -> None:
    samples = max(1, round(max_samples(timing) * share))
    track = create_audio_track(timing, 2, pre_skip, samples)
    packets = random_packets(track.packet_count, 20, 1)
    level = pack_audio_level(track, packets)
    assert len(level.blocks) == timing.block_count
    unpacked = [(index, packet) for index, block in enumerate(level.blocks) for packet in unpack_audio_block(block)]
    assert [packet for _, packet in unpacked] == list(enumerate(packets))
    for index, packet in unpacked:
        start = track.first_sample(packet.number) * 1e6 / SAMPLE_RATE
        # `block_at` allows a microsecond, and the start of a block is rounded to one
        assert index == 0 or timing.start_us(index) <= start + 1.5
        assert index == timing.block_count - 1 or start < timing.start_us(index + 1)
    # the packets cover all samples, and none is superfluous
    assert track.first_sample(len(packets)) >= samples > track.first_sample(len(packets) - 1)


@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_unpacked_or_refused(data: bytes) -> None:
    try:
        packets = unpack_audio_block(data)
    except DamagedBlock:
        return
    assert all(packet_duration_ms(packet.data) == 60 for packet in packets)
    assert packets or not data


def test_packet_duration_follows_rfc_6716() -> None:
    durations = {
        b"\x00": 10, b"\x08": 20, b"\x10": 40, b"\x18": 60, b"\x19": 120, b"\x60": 10, b"\x68": 20, b"\x80": 2.5,
        b"\x98": 20, b"\x99": 40, b"\x9b\x03": 60, b"\x83\x18": 60, b"\xff": 0, b"\xff\x00": 0,
    }  # fmt: skip
    assert {packet: packet_duration_ms(packet) for packet in durations} == durations


def test_wrong_number_or_duration_of_packets_is_refused() -> None:
    track = create_audio_track(TIMING, 1, 120, 48_000)
    with pytest.raises(ValueError, match="17 packets for 48000 samples, not 16"):
        pack_audio_level(track, random_packets(16, 9, 1))
    with pytest.raises(DamagedBlock, match="lasts 20 ms"):
        pack_audio_level(track, [b"\x08a"] * 17)


def test_description_round_trips() -> None:
    track = create_audio_track(TIMING, 2, 120, 100_000)
    described = EncodedAudio(track, [pack_audio_level(track, random_packets(track.packet_count, 90, 2))]).describe()
    assert parse_audio_track(described, TIMING) == track
    assert described["codec"] == AUDIO_CODEC
    assert [track.start_us(n) for n in range(track.block_count)] == [
        TIMING.start_us(n) for n in range(TIMING.block_count)
    ]


@pytest.mark.parametrize(
    ("change", "message"),
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
def test_invalid_description_is_refused(change: dict[str, Any], message: str) -> None:
    track = create_audio_track(TIMING, 2, 120, 100_000)
    described = EncodedAudio(track, [pack_audio_level(track, random_packets(track.packet_count, 90, 2))]).describe()
    with pytest.raises(DamagedBlock, match=message):
        parse_audio_track(described | change, TIMING)


@given(st.integers(1, 400_000), st.integers(0, PACKET_SAMPLES), st.data())
def test_cut_sound_begins_at_the_exact_sample(samples: int, pre_skip: int, data: st.DataObject) -> None:
    whole = create_audio_track(Timing(30.0, 300, 30, 15), 2, pre_skip, samples)
    # every packet tells its number
    packets = [PACKET_PREFIXES[0] + number.to_bytes(2) for number in range(whole.packet_count)]
    level = pack_audio_level(whole, packets)
    first_sample, frames = data.draw(st.integers(0, samples + 1_000)), data.draw(st.integers(1, 90))
    cut = cut_audio(whole, [level.blocks, level.blocks], Timing(30.0, frames, 30, min(15, frames)), first_sample)
    if first_sample >= samples:
        assert cut is None
        return
    assert cut is not None
    track = cut.track
    # the duration of the motion is a whole number of microseconds, which may end within a sample
    assert track.samples == min(samples - first_sample, math.ceil(round(frames * 1e6 / 30) * 0.048))
    assert track.pre_skip <= MAX_PRE_SKIP_SAMPLES
    kept = [packet for block in cut.ladder[1].blocks for packet in unpack_audio_block(block)]
    assert [packet.number for packet in kept] == list(range(track.packet_count))
    first_packet = int.from_bytes(kept[0].data[-2:])
    assert whole.first_sample(first_packet) + track.pre_skip == first_sample
    # the decoder has a packet to converge in, unless the sound begins here
    assert first_packet == 0 or track.pre_skip >= PACKET_SAMPLES
