from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.audio import PACKET, SAMPLE_RATE, audio_track, in_blocks, most_samples, pack_audio
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, even_blocks
from bunraku.playout.sounds import AudioStore
from tests.vectors.audio import packets

LONG = even_blocks(30.0, 300, first_seconds=0.5)


def filled(timing: Timing, share: float = 1.0, missing: int = -1) -> tuple[AudioStore, list[bytes]]:
    track = audio_track(timing, 2, 120, max(1, round(most_samples(timing) * share)))
    sent = packets(track.packets, 30, 3)
    store = AudioStore(track)
    for index, block in enumerate(in_blocks(track, sent).blocks):
        assert index == missing or store.keep(index, 1, block)
    return store, sent


@given(
    st.sampled_from([LONG, even_blocks(59.94, 200), even_blocks(128.0, 40, 0.025), even_blocks(24.0, 1)]),
    st.floats(0.05, 1.0),
    st.floats(0, 1, exclude_max=True),
)
def test_from_any_instant_on_there_is_the_packet_that_is_heard_and_all_after_it(
    timing: Timing, share: float, where: float
) -> None:
    store, sent = filled(timing, share)
    position = int(where * timing.duration_us)
    found = store.packets_from(position)
    sample = position * SAMPLE_RATE // 1_000_000
    if sample >= store.track.samples:
        assert len(found) <= 1, "the silence that fills the last packet up, if any"
        return
    first = store.track.first_sample(found[0].number)
    assert first <= sample < first + PACKET
    assert [packet.number for packet in found] == list(range(found[0].number, store.track.packets))
    assert [packet.data for packet in found] == sent[found[0].number :]


def test_what_is_missing_ends_it_and_what_is_ahead_is_told_in_time() -> None:
    store, _ = filled(LONG, missing=3)
    found = store.packets_from(600_000)
    assert store.track.block_of(found[-1].number) == 2
    assert store.track.block_of(found[-1].number + 1) == 3
    assert store.packets_from(LONG.start_us(3) + 100_000) == []
    assert store.ahead(600_000, False) == LONG.start_us(3) - 600_000
    assert store.ahead(LONG.start_us(4), True) == LONG.duration_us - LONG.start_us(4) + LONG.start_us(3)
    assert store.rate(3) == -1


def test_a_better_rate_takes_the_place_of_a_lower_one() -> None:
    store, _ = filled(LONG)
    other = packets(1, 30, 8)
    assert not store.keep(0, 0, pack_audio(0, other))
    assert store.keep(0, 2, pack_audio(0, other))
    assert store.packets_from(0)[0].data == other[0]
    assert store.rate(0) == 2


def test_what_is_not_of_this_sound_is_refused() -> None:
    store, _ = filled(LONG)
    with pytest.raises(DamagedBlock, match="none of number"):
        store.keep(1, 3, pack_audio(store.track.packets - 1, packets(2, 9, 1)))
    with pytest.raises(DamagedBlock):
        store.keep(1, 3, b"\1")
    with pytest.raises(ValueError, match="not of this motion"):
        store.keep(LONG.blocks, 3, b"")
