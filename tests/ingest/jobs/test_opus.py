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
def test_a_click_stays_within_a_millisecond_of_its_place(channels: int, at: float) -> None:
    sound = make_click(5.0, 48_000, at, channels)
    encoded = encode_audio([to_samples(sound)], TIMING, channels)
    for rate, (kbps, _) in zip(encoded.ladder, BITRATE_LADDERS[channels], strict=True):
        played = decode_opus(split_packets(rate))[encoded.track.pre_skip :][: encoded.track.samples]
        assert len(played) == len(sound)
        for side in played.T:
            assert abs(find_onset(side) - find_onset(sound[:, 0])) < 1e-3, kbps


@pytest.mark.parametrize("channels", [1, 2])
def test_rates_cost_what_they_are_called_and_low_ones_are_mono(channels: int) -> None:
    noise = np.random.default_rng(1).normal(0, 0.1, (240_000, channels))
    encoded = encode_audio([to_samples(noise)], TIMING, channels)
    for rate, (kbps, out) in zip(encoded.ladder, BITRATE_LADDERS[channels], strict=True):
        # with a length before each packet, and a number a block
        assert kbps * 0.9 < rate.kbps < kbps + 0.8
        assert rate.kbps == pytest.approx(sum(map(len, rate.blocks)) * 8e-3 / 5)
        assert {packet[0] >> 2 & 1 for packet in split_packets(rate)} == {out - 1}
        assert {packet_duration_ms(packet) for packet in split_packets(rate)} == {60}
    described = encoded.describe()
    assert (described["channels"], described["samples"]) == (channels, 240_000)


def test_louder_and_softer_come_out_as_they_went_in() -> None:
    sound = make_tone(5.0, 48_000, 2) * np.linspace(0.1, 1, 240_000)[:, None] * [1.0, 0.3]
    best = encode_audio([to_samples(sound)], TIMING, 2)
    played = decode_opus(split_packets(best.ladder[-1]))[best.track.pre_skip :][:240_000]
    off = np.sqrt(np.mean((played - sound) ** 2) / np.mean(sound**2))
    assert off < 0.03


@settings(max_examples=20)
@given(st.integers(1, 20_000), st.lists(st.integers(1, 7_000), max_size=6), st.integers(1, 2))
def test_pieces_of_any_size_make_the_same_packets(count: int, cuts: list[int], channels: int) -> None:
    sound = to_samples(np.random.default_rng(count).normal(0, 0.2, (count, channels)))
    pieces = np.split(sound, np.cumsum(cuts))
    whole, cut = encode_audio([sound], TIMING, channels), encode_audio(pieces, TIMING, channels)
    assert whole.track == cut.track
    assert [rate.blocks for rate in whole.ladder] == [rate.blocks for rate in cut.ladder]
    assert whole.track.samples == count
    assert sum(len(unpack_audio_block(block)) for block in whole.ladder[0].blocks) == whole.track.packet_count


def test_a_change_of_rate_at_any_block_goes_on_in_the_same_sound() -> None:
    sound = make_tone(5.0, 48_000, 2, frequency_hz=330.0)
    encoded = encode_audio([to_samples(sound)], TIMING, 2)
    mixed: list[bytes] = []
    for index in range(encoded.track.block_count):
        mixed += [packet.data for packet in unpack_audio_block(encoded.ladder[index % 3].blocks[index])]
    played = decode_opus(mixed)[encoded.track.pre_skip :][:240_000]
    assert len(played) == 240_000
    # no hole, no jump: what is between the borders and at them is the same tone, but for the coarse rate's error
    steps = np.abs(np.diff(played[2_000:-2_000, 0]))
    assert steps.max() < 2.0 * np.abs(np.diff(sound[:, 0])).max()
    power = np.sqrt(np.mean(played[4_800:-4_800, 0].reshape(-1, 960) ** 2, axis=1))
    assert power.min() > 0.6 * np.sqrt(np.mean(sound**2))


def test_a_decoder_made_anew_in_the_middle_is_soon_right() -> None:
    sound = make_tone(5.0, 48_000, 2, frequency_hz=330.0)
    rate = encode_audio([to_samples(sound)], TIMING, 2).ladder[-1]
    whole, late = split_packets(rate), 40
    played, anew = decode_opus(whole)[late * 2_880 :], decode_opus(whole[late:])
    off = np.abs(anew - played).reshape(-1, 2_880, 2).max(axis=(1, 2))
    assert off[2:].max() < 0.03, "after two packets it is as if it had gone on"
    assert off[5:].max() < 0.001


def test_no_sound_is_refused() -> None:
    with pytest.raises(ValueError, match="one sample"):
        encode_audio([], TIMING, 1)
