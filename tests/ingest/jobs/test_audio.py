from __future__ import annotations

from pathlib import Path

import msgpack
import pytest

from bunraku.codec import container
from bunraku.codec.audio import AudioTrack, unpack_audio_block
from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.audio import add_audio
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.wire.messages import Data
from tests.audio import decode_opus, find_onset, make_click, make_tone, write_audio
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera


@pytest.fixture(scope="module")
def stored() -> StoredMotion:
    encoded = encode_motion(random_motion(2.0, 30.0, 9), 0.7, (30.0, 5.0), grade="live", first_seconds=0.5)
    return container.unpack_motion(
        "one", pack_motion("one", encoded, [encode_scene(sample_camera(2.0, 30.0), error_bounds_mm=(20.0,))])
    )


def add_sound(stored: StoredMotion, path: Path, motion: str = "two") -> tuple[StoredMotion, JobResult]:
    result = add_audio(motion, stored, path)
    assert isinstance(result, JobResult), result
    return container.unpack_motion(motion, result.packed), result


def test_other_tracks_keep_their_bytes(stored: StoredMotion, tmp_path: Path) -> None:
    new, result = add_sound(stored, write_audio(tmp_path / "a.wav", make_click(2.0, 44_100, 1.25, 2), 44_100, "stereo"))
    assert result.description["tracks"] == ["motion", "camera", "audio"]
    assert result.description["made_from"] == "one"
    assert (result.description["audio"]["seconds"], result.description["audio"]["channels"]) == (2.0, 2)
    assert new.packets[:2] == stored.packets
    before, after = (msgpack.unpackb(motion.description[1:]) for motion in (stored, new))
    assert after["tracks"][:2] == before["tracks"]
    assert (before["motion"], after["motion"]) == ("one", "two")
    track = new.tracks[2]
    assert isinstance(track, AudioTrack)
    assert [track.start_us(n) for n in range(track.block_count)] == [stored.first_track.start_us(n) for n in range(3)]
    for rate in new.packets[2]:
        data = [Data.unpack(packet) for packet in rate]
        assert [(one.track, one.index) for one in data] == [(2, 0), (2, 1), (2, 2)]
        packets = [packet.data for one in data for packet in unpack_audio_block(one.block)]
        played = decode_opus(packets)[track.pre_skip :][: track.samples]
        assert abs(find_onset(played[:, 0]) - find_onset(make_click(2.0, 48_000, 1.25)[:, 0])) < 1e-3


def test_second_sound_replaces_the_first(stored: StoredMotion, tmp_path: Path) -> None:
    first, _ = add_sound(stored, write_audio(tmp_path / "a.flac", make_tone(2.0, 48_000), 48_000))
    second, result = add_sound(
        first, write_audio(tmp_path / "b.flac", make_tone(1.0, 48_000, 2), 48_000, "stereo"), "three"
    )
    assert result.description["tracks"] == ["motion", "camera", "audio"]
    assert result.description["made_from"] == "two"
    assert len(second.packets) == 3
    assert second.packets[2] != first.packets[2]
    assert second.tracks[2] != first.tracks[2]


@pytest.mark.parametrize(("seconds", "samples"), [(0.3, 14_400), (1.0, 48_000), (2.0, 96_000), (30.0, 96_000)])
def test_sound_is_padded_or_cut_to_the_motion(
    stored: StoredMotion, tmp_path: Path, seconds: float, samples: int
) -> None:
    shares: list[float] = []
    path = write_audio(tmp_path / "a.mp3", make_tone(seconds, 48_000), 48_000)
    result = add_audio("two", stored, path, shares.append)
    assert isinstance(result, JobResult)
    new = container.unpack_motion("two", result.packed)
    track = new.tracks[2]
    assert isinstance(track, AudioTrack)
    assert track.samples == samples
    assert len(new.packets[2][0]) == track.block_count == 3
    blocks = [unpack_audio_block(Data.unpack(packet).block) for packet in new.packets[2][0]]
    assert [bool(block) for block in blocks] == [track.start_us(n) * 48 // 1000 < samples for n in range(3)]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)


def test_unreadable_sound_is_rejected(stored: StoredMotion, tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    path.write_bytes(b"not a sound")
    rejected = add_audio("two", stored, path)
    assert isinstance(rejected, JobRejection)
    assert rejected.title == "Not a sound"
    assert rejected.hint
