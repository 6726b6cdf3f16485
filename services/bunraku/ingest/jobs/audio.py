"""What a job does to add sound to a motion: the same motion anew, with an audio track beside its others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from bunraku.codec.audio import SAMPLE_RATE, max_samples
from bunraku.codec.container import StoredMotion, add_audio_track
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.ingest.jobs.sound_file import Samples, SoundFile, UnreadableSound
from bunraku.ingest.result import JobRejection, JobResult


def add_audio(
    motion_id: str, stored: StoredMotion, path: Path, progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """The motion `stored` with the sound of the file at `path`, as the motion of this new id; what lies beyond the
    motion's end is left out. `progress` is told the share encoded, 0..1."""
    most = max_samples(stored.first_track)
    try:
        with SoundFile(path) as sound:
            expected = most if sound.duration_s is None else min(most, sound.duration_s * SAMPLE_RATE)
            told = _report_progress(sound.read_samples(most), expected, progress)
            encoded = encode_audio(told, stored.first_track, sound.channels)
    except UnreadableSound as error:
        return JobRejection(error.title, error.detail, hint=error.hint)
    try:
        packed, kinds = add_audio_track(motion_id, stored, encoded)
    except ValueError as error:
        return JobRejection("Too many tracks", str(error))
    described = encoded.describe()
    return JobResult(
        packed,
        {
            "tracks": kinds,
            "audio": {
                "seconds": encoded.track.samples / SAMPLE_RATE,
                "channels": described["channels"],
                "rates": described["rates"],
            },
            "made_from": stored.id,
        },
    )


def _report_progress(
    samples: Iterator[Samples], expected_samples: float, progress: Callable[[float], None]
) -> Iterator[Samples]:
    heard = 0
    progress(0.0)
    for piece in samples:
        yield piece
        heard += len(piece)
        progress(min(heard / expected_samples, 1.0) if expected_samples > 0 else 1.0)
