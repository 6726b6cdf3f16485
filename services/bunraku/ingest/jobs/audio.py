"""Job that adds the sound of a file to a motion as an audio track."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from bunraku.codec.audio import SAMPLE_RATE, max_samples
from bunraku.codec.container import StoredMotion, add_audio_track
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.ingest.jobs.sound_file import Samples, SoundFile, UnreadableSound
from bunraku.ingest.result import JobRejection, JobResult


def add_audio(
    motion_id: str, stored: StoredMotion, path: Path, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Return a copy of `stored` with the new id and the sound of a file; sound beyond the motion's end is cut.

    `on_progress` receives the encoded share, 0..1.
    """
    limit = max_samples(stored.first_track)
    try:
        with SoundFile(path) as sound:
            expected = limit if sound.duration_s is None else min(limit, sound.duration_s * SAMPLE_RATE)
            samples = _report_progress(sound.read_samples(limit), expected, on_progress)
            encoded = encode_audio(samples, stored.first_track, sound.channels)
    except UnreadableSound as error:
        return JobRejection(error.title, error.detail, hint=error.hint)
    try:
        packed, track_kinds = add_audio_track(motion_id, stored, encoded)
    except ValueError as error:
        return JobRejection("Too many tracks", str(error))
    audio = encoded.describe()
    return JobResult(
        packed,
        {
            "tracks": track_kinds,
            "audio": {
                "seconds": encoded.track.samples / SAMPLE_RATE,
                "channels": audio["channels"],
                "rates": audio["rates"],
            },
            "made_from": stored.id,
        },
    )


def _report_progress(
    chunks: Iterator[Samples], expected_samples: float, on_progress: Callable[[float], None]
) -> Iterator[Samples]:
    sample_count = 0
    on_progress(0.0)
    for chunk in chunks:
        yield chunk
        sample_count += len(chunk)
        on_progress(min(sample_count / expected_samples, 1.0) if expected_samples > 0 else 1.0)
