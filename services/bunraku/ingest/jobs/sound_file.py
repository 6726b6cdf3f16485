"""Decoding of sound files (WAV, FLAC, MP3, Ogg) to one or two channels at 48 kHz, the rate of Opus."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Self

import av
import numpy as np
import numpy.typing as npt
from av.audio.frame import AudioFrame
from av.audio.resampler import AudioResampler
from av.audio.stream import AudioStream

from bunraku.codec.audio import SAMPLE_RATE

Samples = npt.NDArray[np.float32]
"""Samples (n, channels), within -1..1."""

MAX_CHANNELS = 8
MIN_SAMPLE_RATE, MAX_SAMPLE_RATE = 8_000, 192_000
"""Accepted sample rates, in Hz."""
SUPPORTED_CODECS = ("flac", "mp3", "mp3float", "opus", "libopus", "vorbis", "libvorbis")
"""Accepted codecs, besides uncompressed ones (`pcm_...`)."""
_DURATION_TOLERANCE_S = 0.1
"""Tolerated difference between the actual and the declared duration of a FLAC file, in seconds."""
_UNKNOWN_WAV_SIZE = 0xFFFFFFFF
"""Size field of a WAV file of unknown size, as written by streaming encoders."""
_SUPPORTED_FORMATS_HINT = "upload WAV, FLAC, MP3 or Ogg (Vorbis, Opus)"

av.logging.set_level(av.logging.PANIC)


class UnreadableSound(ValueError):
    """A file that cannot be decoded, with title, detail and hint of the problem document."""

    def __init__(self, title: str, detail: str, hint: str = _SUPPORTED_FORMATS_HINT) -> None:
        super().__init__(detail)
        self.title, self.detail, self.hint = title, detail, hint


class SoundFile:
    """Open sound file, used as a context manager; opening raises `UnreadableSound`. The first sample is at time 0."""

    def __init__(self, path: Path) -> None:
        file_format = _detect_format(path)
        try:
            self._container = av.open(
                str(path), format=file_format, options={"format_whitelist": file_format}, metadata_errors="ignore"
            )
        except (av.FFmpegError, ValueError, EOFError) as error:
            raise UnreadableSound(
                "Unreadable sound", f"this {file_format.upper()} file cannot be decoded: {_error_detail(error)}"
            ) from None
        try:
            self._stream = self._select_stream(file_format)
        except BaseException:
            self._container.close()
            raise
        self._source_channels = self._stream.codec_context.channels
        self.channels = min(self._source_channels, 2)
        """Channels of `read_samples`, 1 or 2."""
        length = self._stream.duration
        base = self._stream.time_base
        self.duration_s = float(length * base) if length and base else None
        """Declared duration, which may be estimated or wrong; None if not declared."""
        self._declared_duration_s = self.duration_s if file_format == "flac" else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._container.close()

    def read_samples(self, max_samples: int) -> Iterator[Samples]:
        """Yield the sound in chunks, at most `max_samples` per channel; raise `UnreadableSound` at damaged data."""
        resampler = AudioResampler("flt", None, SAMPLE_RATE)
        mix = (
            _stereo_mix_matrix([channel.name for channel in self._stream.layout.channels])
            if self._source_channels > 2
            else None
        )
        remaining, decoded = max_samples, 0
        for frame in self._decode_frames():
            decoded += frame.samples if frame is not None else 0
            try:
                resampled = resampler.resample(frame)
            except (av.FFmpegError, ValueError) as error:
                raise _damaged_error(self._samples_to_seconds(decoded), error) from None
            for chunk in resampled:
                values = chunk.to_ndarray().reshape(-1, self._source_channels)[:remaining]
                values = values if mix is None else values @ mix
                if not np.isfinite(values).all():
                    raise UnreadableSound(
                        "Not a number",
                        f"a sample near {self._samples_to_seconds(decoded):.1f} s is not a finite number",
                        "export the sound again",
                    )
                remaining -= len(values)
                yield np.clip(values, -1.0, 1.0)
            if remaining == 0:
                return
        if decoded == 0:
            raise UnreadableSound("No sound", "the file contains no samples")
        declared_s, actual_s = self._declared_duration_s, self._samples_to_seconds(decoded)
        if declared_s is not None and actual_s < declared_s - _DURATION_TOLERANCE_S:
            raise _truncated_error(f"the file declares {declared_s:.1f} s of sound and ends after {actual_s:.1f} s")

    def _select_stream(self, container_format: str) -> AudioStream:
        if not self._container.streams.audio:
            raise UnreadableSound("No sound", f"this {container_format.upper()} file has no audio stream")
        stream = self._container.streams.audio[0]
        context = stream.codec_context
        if context is None or context.codec is None:
            raise UnreadableSound("Unreadable sound", f"this {container_format.upper()} file has an unknown codec")
        if not (context.name in SUPPORTED_CODECS or context.name.startswith("pcm_")):
            raise UnreadableSound("Unreadable sound", f"the codec {context.name} is not supported")
        if not 1 <= context.channels <= MAX_CHANNELS:
            detail = f"the file has {context.channels} channels, supported are up to {MAX_CHANNELS}"
            raise UnreadableSound("Too many channels", detail, "mix it down to stereo")
        if not MIN_SAMPLE_RATE <= context.sample_rate <= MAX_SAMPLE_RATE:
            detail = (
                f"the sample rate is {context.sample_rate} Hz, supported are {MIN_SAMPLE_RATE} to {MAX_SAMPLE_RATE} Hz"
            )
            raise UnreadableSound("Unusual rate", detail, "resample it to 48000 Hz")
        return stream

    def _decode_frames(self) -> Iterator[AudioFrame | None]:
        """Yield decoded frames, then None."""
        frames = self._container.decode(self._stream)
        decoded = 0
        while True:
            try:
                frame = next(frames, None)
            except (av.FFmpegError, ValueError, EOFError) as error:
                raise _damaged_error(self._samples_to_seconds(decoded), error) from None
            if frame is not None:
                # time is counted in samples: timestamps of a container may have gaps
                frame.pts = None
                decoded += frame.samples
            yield frame
            if frame is None:
                return

    def _samples_to_seconds(self, sample_count: int) -> float:
        return sample_count / self._stream.codec_context.sample_rate


def _stereo_mix_matrix(channel_names: list[str]) -> Samples:
    """Return the matrix (channels, 2) that mixes channels with these FFmpeg names to stereo.

    Each side gets its front channel and half the power of centre and rear channels, without low-frequency effects. The
    mix is scaled so that it cannot exceed full level.
    """
    mix = np.zeros((len(channel_names), 2), dtype=np.float32)
    for index, name in enumerate(channel_names):
        if not name.startswith("LFE"):
            weight = 1.0 if name in ("FL", "FR") else 0.5**0.5
            mix[index] = weight * (not name.endswith("R")), weight * (not name.endswith("L"))
    mixed: Samples = mix / max(float(mix.sum(axis=0).max()), 1.0)
    return mixed


def _truncated_error(detail: str) -> UnreadableSound:
    return UnreadableSound("Cut off", detail, "upload the complete file")


def _error_detail(error: Exception) -> str:
    # without the path of the file, which str() of an FFmpeg error contains
    text = error.strerror if isinstance(error, av.FFmpegError) else str(error)
    return text or type(error).__name__


def _damaged_error(seconds: float, error: Exception) -> UnreadableSound:
    return UnreadableSound(
        "Damaged sound",
        f"the sound cannot be decoded after {seconds:.1f} s: {_error_detail(error)}",
        "export it again, or cut it there",
    )


def _detect_format(path: Path) -> str:
    """Return FFmpeg's name of the format, detected by the first bytes; raise `UnreadableSound`."""
    with path.open("rb") as file:
        head = file.read(12)
        if head[:3] == b"ID3" and len(head) >= 10:
            # an ID3 tag precedes the sound; its size has 4 x 7 bits
            file.seek(10 + (head[6] << 21 | head[7] << 14 | head[8] << 7 | head[9]))
            return "flac" if file.read(4) == b"fLaC" else "mp3"
    if not head:
        raise UnreadableSound("Empty file", "the file has no content")
    if head[:4] in (b"RIFF", b"RF64") and head[8:] == b"WAVE":
        # FFmpeg accepts truncated files; the padding byte may be missing
        declared, size = int.from_bytes(head[4:8], "little") + 8, path.stat().st_size
        if declared != _UNKNOWN_WAV_SIZE + 8 and size + 1 < declared:
            raise _truncated_error(f"the file declares {declared} bytes and ends after {size}")
        return "wav"
    if head[:4] == b"fLaC":
        return "flac"
    if head[:4] == b"OggS":
        return "ogg"
    if len(head) > 1 and head[0] == 0xFF and head[1] >= 0xE0 and head[1] & 6:
        return "mp3"
    raise UnreadableSound("Not a sound", "the file is not in a supported sound format")
