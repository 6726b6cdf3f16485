from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.codec.audio import AudioLevel, packet_duration_ms, unpack_audio_block
from bunraku.codec.timing import plan_timing
from bunraku.ingest.jobs.opus import BITRATE_LADDERS, encode_audio
from bunraku.ingest.jobs.sound_file import Samples
from tests.audio import decode_opus, find_onset, make_click, make_tone

TIMING = plan_timing(30.0, 150, first_seconds=0.5)


def to_samples(sound: np.ndarray) -> Samples:
    return sound.astype(np.float32)


def split_packets(rate: AudioLevel) -> list[bytes]:
    return [packet.data for block in rate.blocks for packet in unpack_audio_block(block)]


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("at", [0.0, 1.0, 3.777])
def test_click_is_displaced_by_less_than_a_millisecond(channels: int, at: float) -> None:
    sound = make_click(5.0, 48_000, at, channels)
    encoded = encode_audio([to_samples(sound)], TIMING, channels)
    for rate, (kbps, _) in zip(encoded.ladder, BITRATE_LADDERS[channels], strict=True):
        played = decode_opus(split_packets(rate))[encoded.track.pre_skip :][: encoded.track.samples]
        assert len(played) == len(sound)
        for side in played.T:
            assert abs(find_onset(side) - find_onset(sound[:, 0])) < 1e-3, kbps


@pytest.mark.parametrize("channels", [1, 2])
def test_levels_have_their_bitrate_and_channels(channels: int) -> None:
    noise = np.random.default_rng(1).normal(0, 0.1, (240_000, channels))
    encoded = encode_audio([to_samples(noise)], TIMING, channels)
    for rate, (kbps, level_channels) in zip(encoded.ladder, BITRATE_LADDERS[channels], strict=True):
        # includes the length before each packet and the number of each block
        assert kbps * 0.9 < rate.kbps < kbps + 0.8
        assert rate.kbps == pytest.approx(sum(map(len, rate.blocks)) * 8e-3 / 5)
        assert {packet[0] >> 2 & 1 for packet in split_packets(rate)} == {level_channels - 1}
        assert {packet_duration_ms(packet) for packet in split_packets(rate)} == {60}
    described = encoded.describe()
    assert (described["channels"], described["samples"]) == (channels, 240_000)


def test_loudness_is_preserved() -> None:
    sound = make_tone(5.0, 48_000, 2) * np.linspace(0.1, 1, 240_000)[:, None] * [1.0, 0.3]
    best = encode_audio([to_samples(sound)], TIMING, 2)
    played = decode_opus(split_packets(best.ladder[-1]))[best.track.pre_skip :][:240_000]
    error = np.sqrt(np.mean((played - sound) ** 2) / np.mean(sound**2))
    assert error < 0.03


@settings(max_examples=20)
@given(st.integers(1, 20_000), st.lists(st.integers(1, 7_000), max_size=6), st.integers(1, 2))
def test_chunk_sizes_do_not_change_the_packets(count: int, cuts: list[int], channels: int) -> None:
    sound = to_samples(np.random.default_rng(count).normal(0, 0.2, (count, channels)))
    chunks = np.split(sound, np.cumsum(cuts))
    unsplit, split = encode_audio([sound], TIMING, channels), encode_audio(chunks, TIMING, channels)
    assert unsplit.track == split.track
    assert [rate.blocks for rate in unsplit.ladder] == [rate.blocks for rate in split.ladder]
    assert unsplit.track.samples == count
    assert sum(len(unpack_audio_block(block)) for block in unsplit.ladder[0].blocks) == unsplit.track.packet_count


def test_level_switch_between_blocks_is_seamless() -> None:
    sound = make_tone(5.0, 48_000, 2, frequency_hz=330.0)
    encoded = encode_audio([to_samples(sound)], TIMING, 2)
    mixed: list[bytes] = []
    for index in range(encoded.track.block_count):
        mixed += [packet.data for packet in unpack_audio_block(encoded.ladder[index % 3].blocks[index])]
    played = decode_opus(mixed)[encoded.track.pre_skip :][:240_000]
    assert len(played) == 240_000
    # no gap, no jump: the tone continues across borders, apart from the error of the lowest level
    steps = np.abs(np.diff(played[2_000:-2_000, 0]))
    assert steps.max() < 2.0 * np.abs(np.diff(sound[:, 0])).max()
    power = np.sqrt(np.mean(played[4_800:-4_800, 0].reshape(-1, 960) ** 2, axis=1))
    assert power.min() > 0.6 * np.sqrt(np.mean(sound**2))


def test_decoder_started_in_the_middle_converges() -> None:
    sound = make_tone(5.0, 48_000, 2, frequency_hz=330.0)
    rate = encode_audio([to_samples(sound)], TIMING, 2).ladder[-1]
    packets, start = split_packets(rate), 40
    played, restarted = decode_opus(packets)[start * 2_880 :], decode_opus(packets[start:])
    error = np.abs(restarted - played).reshape(-1, 2_880, 2).max(axis=(1, 2))
    assert error[2:].max() < 0.03, "converges after two packets"
    assert error[5:].max() < 0.001


def test_sound_without_samples_is_rejected() -> None:
    with pytest.raises(ValueError, match="at least one sample"):
        encode_audio([], TIMING, 1)
