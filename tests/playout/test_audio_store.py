from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.audio import (
    PACKET_SAMPLES,
    SAMPLE_RATE,
    create_audio_track,
    max_samples,
    pack_audio_block,
    pack_audio_level,
)
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, plan_timing
from bunraku.playout.audio_store import AudioBlockStore
from tests.vectors.audio import random_packets

LONG = plan_timing(30.0, 300, first_seconds=0.5)


def filled_store(timing: Timing, share: float = 1.0, missing: int = -1) -> tuple[AudioBlockStore, list[bytes]]:
    track = create_audio_track(timing, 2, 120, max(1, round(max_samples(timing) * share)))
    sent = random_packets(track.packet_count, 30, 3)
    store = AudioBlockStore(track)
    for index, block in enumerate(pack_audio_level(track, sent).blocks):
        assert index == missing or store.put_encoded(index, 1, block)
    return store, sent


@given(
    st.sampled_from([LONG, plan_timing(59.94, 200), plan_timing(128.0, 40, 0.025), plan_timing(24.0, 1)]),
    st.floats(0.05, 1.0),
    st.floats(0, 1, exclude_max=True),
)
def test_packets_from_position_are_complete(timing: Timing, share: float, share_of_duration: float) -> None:
    store, sent = filled_store(timing, share)
    position = int(share_of_duration * timing.duration_us)
    found = store.packets_from(position)
    sample = position * SAMPLE_RATE // 1_000_000
    if sample >= store.track.samples:
        assert len(found) <= 1, "the silence that fills the last packet up, if any"
        return
    first = store.track.first_sample(found[0].number)
    assert first <= sample < first + PACKET_SAMPLES
    assert [packet.number for packet in found] == list(range(found[0].number, store.track.packet_count))
    assert [packet.data for packet in found] == sent[found[0].number :]


def test_missing_block_ends_packets_and_buffered_time() -> None:
    store, _ = filled_store(LONG, missing=3)
    found = store.packets_from(600_000)
    assert store.track.block_of_packet(found[-1].number) == 2
    assert store.track.block_of_packet(found[-1].number + 1) == 3
    assert store.packets_from(LONG.start_us(3) + 100_000) == []
    assert store.buffered_us(600_000, False) == LONG.start_us(3) - 600_000
    assert store.buffered_us(LONG.start_us(4), True) == LONG.duration_us - LONG.start_us(4) + LONG.start_us(3)
    assert store.level(3) == -1


def test_higher_level_replaces_lower_one() -> None:
    store, _ = filled_store(LONG)
    other = random_packets(1, 30, 8)
    assert not store.put_encoded(0, 0, pack_audio_block(0, other))
    assert store.put_encoded(0, 2, pack_audio_block(0, other))
    assert store.packets_from(0)[0].data == other[0]
    assert store.level(0) == 2


def test_blocks_of_another_track_are_rejected() -> None:
    store, _ = filled_store(LONG)
    with pytest.raises(DamagedBlock, match="packets only"):
        store.put_encoded(1, 3, pack_audio_block(store.track.packet_count - 1, random_packets(2, 9, 1)))
    with pytest.raises(DamagedBlock):
        store.put_encoded(1, 3, b"\1")
    with pytest.raises(ValueError, match="not belong to this track"):
        store.put_encoded(LONG.block_count, 3, b"")
