from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from bunraku.ingest.jobs.sound_file import SoundFile, UnreadableSound
from tests.audio import AUDIO_FORMATS, find_onset, make_click, make_tone, write_audio

UNLIMITED_SAMPLES = 1 << 40


def read_file(path: Path, max_samples: int = UNLIMITED_SAMPLES) -> np.ndarray:
    with SoundFile(path) as sound:
        return np.concatenate(list(sound.read_samples(max_samples)))


def can_encode(kind: str, rate: int, layout: str) -> bool:
    """Return whether FFmpeg can write this format with this sample rate and layout."""
    if kind == "mp3":
        return rate <= 48_000 and layout != "5.1"
    if kind == "opus.ogg":
        return rate in (8_000, 48_000)
    return kind != "vorbis.ogg" or layout == "stereo"


@pytest.mark.parametrize(
    ("kind", "rate", "layout"),
    [
        (kind, rate, layout)
        for kind in AUDIO_FORMATS
        for rate in (8_000, 44_100, 48_000, 96_000)
        for layout in ("mono", "stereo", "5.1")
        if can_encode(kind, rate, layout)
    ],
)
def test_every_format_is_decoded_sample_exact(tmp_path: Path, kind: str, rate: int, layout: str) -> None:
    channels = {"mono": 1, "stereo": 2, "5.1": 6}[layout]
    path = write_audio(tmp_path / f"a.{kind}", make_click(1.5, rate, 0.7, channels), rate, layout)
    sound = read_file(path)
    assert sound.shape[1] == min(channels, 2)
    # FFmpeg's Vorbis encoder fills the last block
    assert abs(len(sound) - 72_000) <= (2_048 * 48_000 / rate if kind == "vorbis.ogg" else 1)
    for side in sound.T:
        assert abs(find_onset(side) - find_onset(make_click(1.5, 48_000, 0.7)[:, 0])) < 0.3e-3
        assert 0.4 < np.abs(side).max() <= 1


def test_surround_is_mixed_to_stereo_without_clipping(tmp_path: Path) -> None:
    mixed = read_file(write_audio(tmp_path / "a.wav", make_tone(0.5, 48_000, 6, amplitude=0.99), 48_000, "5.1"))
    assert 0.9 < np.abs(mixed).max() <= 1
    assert np.count_nonzero(np.abs(mixed) > 0.98) < 5_000
    # FFmpeg's order: front left, front right, centre, LFE, back left, back right
    for channel, loudest in ((0, 0), (1, 1), (4, 0), (5, 1)):
        single = np.zeros((24_000, 6))
        single[:, channel] = make_tone(0.5, 48_000)[:, 0]
        sides = np.abs(read_file(write_audio(tmp_path / "b.wav", single, 48_000, "5.1"))).max(axis=0)
        assert sides[loudest] > 0.1
        assert sides[1 - loudest] == 0
    centre = np.zeros((24_000, 6))
    centre[:, 2] = make_tone(0.5, 48_000)[:, 0]
    sides = np.abs(read_file(write_audio(tmp_path / "c.wav", centre, 48_000, "5.1"))).max(axis=0)
    assert sides[0] == sides[1] > 0.1


def test_samples_beyond_the_limit_are_not_read(tmp_path: Path) -> None:
    path = write_audio(tmp_path / "a.flac", make_tone(2.0, 44_100), 44_100)
    complete = read_file(path)
    np.testing.assert_array_equal(read_file(path, 30_001), complete[:30_001])
    # damaged data beyond the limit is not read either
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    np.testing.assert_array_equal(read_file(path, 30_001), complete[:30_001])


def make_wav(
    samples: bytes, declared: int, rate: int = 8_000, channels: int = 1, code: int = 1, bits: int = 16
) -> bytes:
    align = channels * bits // 8
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, code, channels, rate, rate * align, align, bits)
    return (
        struct.pack("<4sI4s", b"RIFF", min(declared + 36, 0xFFFFFFFF), b"WAVE")
        + form
        + struct.pack("<4sI", b"data", declared)
        + samples
    )


def claim_ten_hours(flac: bytes) -> bytes:
    """Change the header to declare ten hours at 44.1 kHz: 36 bits of samples in bytes 21 to 25."""
    count = 36_000 * 44_100
    return flac[:21] + bytes([flac[21] & 0xF0 | count >> 32]) + (count & 0xFFFFFFFF).to_bytes(4, "big") + flac[26:]


def make_sound(tmp_path: Path, kind: str, seconds: float = 2.0) -> bytes:
    rate = 48_000 if kind == "opus.ogg" else 44_100
    noise = np.random.default_rng(1).normal(0, 0.1, (round(seconds * rate), 2))
    return write_audio(tmp_path / f"made.{kind}", noise, rate, "stereo").read_bytes()


def test_unreadable_file_is_rejected_with_the_reason(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    nan = struct.pack("<f", float("nan"))
    cases: dict[str, tuple[bytes, str, str]] = {
        "empty": (b"", "Empty file", "no content"),
        "text": (b"HIERARCHY\nROOT a\n{\n", "Not a sound", ""),
        "picture": (b"\x89PNG\r\n\x1a\n" + bytes(1000), "Not a sound", ""),
        "noise": (b"\x01" + random.bytes(100_000), "Not a sound", ""),
        "noise that looks like MP3": (b"\xff\xfb\x90" + random.bytes(100_000), "", ""),
        "MP3 of zeros": (b"\xff\xfb" + bytes(10_000), "", ""),
        "a tag alone": (b"ID3\x04\x00\x00\x00\x00\x00\x0a" + bytes(10), "", ""),
        "Ogg of zeros": (b"OggS" + bytes(10_000), "Unreadable sound", "OGG"),
        "FLAC of zeros": (b"fLaC" + bytes(10_000), "Unreadable sound", "FLAC"),
        "WAV of zeros": (b"RIFF\0\0\0\0WAVE" + bytes(10_000), "", ""),
        "ten hours declared, no data": (make_wav(b"", 576_000_000), "Cut off", "576000044 bytes and ends after 44"),
        "ten hours declared, one second of data": (make_wav(bytes(16_000), 576_000_000), "Cut off", "ends after 16044"),
        "unknown length declared, no data": (make_wav(b"", 0xFFFFFFFF), "No sound", ""),
        "no sample": (make_wav(b"", 0), "No sound", ""),
        "FLAC that ends between two frames": (claim_ten_hours(make_sound(tmp_path, "flac")), "Cut off", "36000.0 s"),
        "FLAC cut off": (make_sound(tmp_path, "flac")[:-20_000], "", ""),
        "too many channels": (make_wav(bytes(1800), 1800, channels=9), "Too many channels", "9 channels"),
        "no channels": (make_wav(bytes(1800), 1800, channels=0), "", ""),
        "no rate": (make_wav(bytes(1800), 1800, rate=0), "", ""),
        "a slow rate": (make_wav(bytes(1800), 1800, rate=4_000), "Unusual rate", "4000"),
        "a fast rate": (make_wav(bytes(1800), 1800, rate=1_000_000), "Unusual rate", "1000000"),
        "an old codec": (make_wav(bytes(1800), 1800, code=0x11, bits=4), "Unreadable sound", "adpcm"),
        "an unknown codec": (make_wav(bytes(1800), 1800, code=0x5555), "Unreadable sound", "unknown codec"),
        "not a number": (make_wav(bytes(400) + nan + bytes(400), 804, code=3, bits=32), "Not a number", "near 0.0 s"),
    }
    for name, (data, title, message) in cases.items():
        path = tmp_path / "case"
        path.write_bytes(data)
        try:
            sound = read_file(path)
        except UnreadableSound as raised:
            error = raised
        else:
            pytest.fail(f"{name}: {len(sound)} samples were decoded")
        assert str(tmp_path) not in error.detail, "the detail must not contain the server's path"
        assert title in error.title, (name, error.title, str(error))
        assert message in error.detail, (name, str(error))
        assert error.hint, name


def test_tags_are_skipped(tmp_path: Path) -> None:
    sound = struct.pack("<800h", *range(800))
    complete = make_wav(sound, len(sound))
    title = b"LIST" + struct.pack("<I", 4 + 8 + 6) + b"INFOINAM" + struct.pack("<I", 6) + b"\xc9t\xe9 \xff\0"
    tagged = complete[:4] + struct.pack("<I", len(complete) + len(title) - 8) + complete[8:36] + title + complete[36:]
    song = make_sound(tmp_path, "mp3")
    picture = (
        b"ID3\x03\x00\x00" + bytes([0, 0, 8, 0]) + b"APIC\x00\x00\x03\xf0\x00\x00\x00image/png\0\3\0" + b"\x89PNG" * 249
    )
    picture = picture.ljust(10 + 1024, b"\0")
    for name, plain, more in (("wav", complete, tagged), ("mp3", song, picture + song)):
        path = tmp_path / name
        path.write_bytes(plain)
        bare = read_file(path)
        path.write_bytes(more)
        np.testing.assert_array_equal(read_file(path), bare)


@pytest.mark.parametrize("kind", ["mp3", "opus.ogg", "vorbis.ogg"])
def test_truncated_file_without_a_length_is_decoded(tmp_path: Path, kind: str) -> None:
    complete = make_sound(tmp_path, kind, 8.0)
    path = tmp_path / "part"
    path.write_bytes(complete[: len(complete) // 2])
    assert 2 * 48_000 < len(read_file(path)) < 6 * 48_000


@pytest.mark.parametrize("kind", ["wav", "flac", "mp3", "opus.ogg", "vorbis.ogg"])
def test_damaged_file_is_rejected_or_decoded_within_bounds(tmp_path: Path, kind: str) -> None:
    complete, random = make_sound(tmp_path, kind), np.random.default_rng(3)
    path = tmp_path / "damaged"
    for _ in range(20):
        damaged = bytearray(complete)
        at = int(random.integers(len(damaged)))
        damaged[at : at + 200] = random.bytes(min(200, len(damaged) - at))
        path.write_bytes(damaged)
        try:
            sound = read_file(path, 200_000)
        except UnreadableSound:
            continue
        assert 0 < len(sound) <= 200_000
        assert np.isfinite(sound).all()
        assert np.abs(sound).max() <= 1
