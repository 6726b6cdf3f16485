"""What a job does to add sound to a motion: the same motion anew, with an audio track beside its others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from bunraku.backing.library import StoredMotion, with_audio
from bunraku.codec.audio import SAMPLE_RATE, most_samples
from bunraku.ingest.opus import encode_audio
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.sound import Samples, SoundFile, UnreadableSound


def add(
    motion: str, stored: StoredMotion, path: Path, progress: Callable[[float], None] = lambda _: None
) -> Made | Refused:
    """The motion `stored` with the sound of the file at `path`, as the motion of this new id; what lies beyond the
    motion's end is left out. `progress` is told the share encoded, 0..1."""
    most = most_samples(stored.track)
    try:
        with SoundFile(path) as sound:
            expected = most if sound.seconds is None else min(most, sound.seconds * SAMPLE_RATE)
            told = _told(sound.samples(most), expected, progress)
            encoded = encode_audio(told, stored.track, sound.channels)
    except UnreadableSound as error:
        return Refused(error.title, error.detail, hint=error.hint)
    try:
        packed, kinds = with_audio(motion, stored, encoded)
    except ValueError as error:
        return Refused("Too many tracks", str(error))
    described = encoded.describe()
    return Made(
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


def _told(sound: Iterator[Samples], expected: float, progress: Callable[[float], None]) -> Iterator[Samples]:
    heard = 0
    progress(0.0)
    for piece in sound:
        yield piece
        heard += len(piece)
        progress(min(heard / expected, 1.0) if expected > 0 else 1.0)
