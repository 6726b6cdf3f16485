"""A sound file as samples: WAV, FLAC, MP3 and Ogg, of any usual rate, to one or two channels at Opus's 48 kHz."""

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
"""(n, channels), each within -1..1."""

MAX_CHANNELS = 8
MIN_SAMPLE_RATE, MAX_SAMPLE_RATE = 8_000, 192_000
"""Samples a second."""
SUPPORTED_CODECS = ("flac", "mp3", "mp3float", "opus", "libopus", "vorbis", "libvorbis")
"""That are read, beside those of plain samples (`pcm_...`)."""
_DURATION_TOLERANCE_S = 0.1
"""Seconds by which there may be less of a FLAC file than its head says."""
_UNKNOWN_WAV_SIZE = 0xFFFFFFFF
"""Size of a WAV file that was written without knowing it."""
_SUPPORTED_FORMATS_HINT = "send WAV, FLAC, MP3 or Ogg (Vorbis, Opus)"

av.logging.set_level(av.logging.PANIC)


class UnreadableSound(ValueError):
    """Why a file cannot be heard: title, detail and hint of a problem."""

    def __init__(self, title: str, detail: str, hint: str = _SUPPORTED_FORMATS_HINT) -> None:
        super().__init__(detail)
        self.title, self.detail, self.hint = title, detail, hint


class SoundFile:
    """An open sound file; its first sample is at time 0. Use as a context manager. Raises `UnreadableSound`."""

    def __init__(self, path: Path) -> None:
        form = _detect_format(path)
        try:
            self._container = av.open(
                str(path), format=form, options={"format_whitelist": form}, metadata_errors="ignore"
            )
        except (av.FFmpegError, ValueError, EOFError) as error:
            raise UnreadableSound(
                "Unreadable sound", f"this {form.upper()} file cannot be read: {_error_detail(error)}"
            ) from None
        try:
            self._stream = self._select_stream(form)
        except BaseException:
            self._container.close()
            raise
        self._source_channels = self._stream.codec_context.channels
        self.channels = min(self._source_channels, 2)
        """1 or 2, as `samples` gives them."""
        length = self._stream.duration
        base = self._stream.time_base
        self.duration_s = float(length * base) if length and base else None
        """How long the file says it is, which may be guessed or wrong; None where it says nothing."""
        self._declared_duration_s = self.duration_s if form == "flac" else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._container.close()

    def read_samples(self, max_samples: int) -> Iterator[Samples]:
        """The sound in pieces, `most` samples of each channel at most; raises `UnreadableSound` on the way."""
        resampler = AudioResampler("flt", None, SAMPLE_RATE)
        mix = (
            _stereo_mix_matrix([channel.name for channel in self._stream.layout.channels])
            if self._source_channels > 2
            else None
        )
        left, heard = max_samples, 0
        for frame in self._decode_frames():
            heard += frame.samples if frame is not None else 0
            try:
                resampled = resampler.resample(frame)
            except (av.FFmpegError, ValueError) as error:
                raise _damaged_error(self._samples_to_seconds(heard), error) from None
            for piece in resampled:
                values = piece.to_ndarray().reshape(-1, self._source_channels)[:left]
                values = values if mix is None else values @ mix
                if not np.isfinite(values).all():
                    raise UnreadableSound(
                        "Not a number",
                        f"a sample near {self._samples_to_seconds(heard):.1f} s is no number",
                        "export the sound anew",
                    )
                left -= len(values)
                yield np.clip(values, -1.0, 1.0)
            if left == 0:
                return
        if heard == 0:
            raise UnreadableSound("No sound", "there is not a single sample in this file")
        if (
            self._declared_duration_s is not None
            and self._samples_to_seconds(heard) < self._declared_duration_s - _DURATION_TOLERANCE_S
        ):
            raise _truncated_error(
                f"the file says that it lasts {self._declared_duration_s:.1f} s and ends after {self._samples_to_seconds(heard):.1f} s"
            )

    def _select_stream(self, container_format: str) -> AudioStream:
        if not self._container.streams.audio:
            raise UnreadableSound("No sound", f"this {container_format.upper()} file has no sound in it")
        stream = self._container.streams.audio[0]
        context = stream.codec_context
        if not (context.name in SUPPORTED_CODECS or context.name.startswith("pcm_")):
            raise UnreadableSound("Unreadable sound", f"its sound is in {context.name}, which is not read here")
        if not 1 <= context.channels <= MAX_CHANNELS:
            detail = f"it has {context.channels} channels, and up to {MAX_CHANNELS} are read"
            raise UnreadableSound("Too many channels", detail, "mix it down to two")
        if not MIN_SAMPLE_RATE <= context.sample_rate <= MAX_SAMPLE_RATE:
            detail = (
                f"it has {context.sample_rate} samples a second, and {MIN_SAMPLE_RATE} to {MAX_SAMPLE_RATE} are read"
            )
            raise UnreadableSound("Unusual rate", detail, "resample it to 48000")
        return stream

    def _decode_frames(self) -> Iterator[AudioFrame | None]:
        """What is decoded, and None at the end."""
        frames = self._container.decode(self._stream)
        heard = 0
        while True:
            try:
                frame = next(frames, None)
            except (av.FFmpegError, ValueError, EOFError) as error:
                raise _damaged_error(self._samples_to_seconds(heard), error) from None
            if frame is not None:
                # time is counted in samples: what a container says of it may have gaps
                frame.pts = None
                heard += frame.samples
            yield frame
            if frame is None:
                return

    def _samples_to_seconds(self, sample_count: int) -> float:
        return sample_count / self._stream.codec_context.sample_rate


def _stereo_mix_matrix(channel_names: list[str]) -> Samples:
    """What channels of these names (as FFmpeg has them) are mixed by, (channels, 2): those of one side, and half the
    power of what is in the middle or behind, without the low-frequency effects; no louder than full."""
    mix = np.zeros((len(channel_names), 2), dtype=np.float32)
    for number, name in enumerate(channel_names):
        if not name.startswith("LFE"):
            weight = 1.0 if name in ("FL", "FR") else 0.5**0.5
            mix[number] = weight * (not name.endswith("R")), weight * (not name.endswith("L"))
    mixed: Samples = mix / max(float(mix.sum(axis=0).max()), 1.0)
    return mixed


def _truncated_error(detail: str) -> UnreadableSound:
    return UnreadableSound("Cut off", detail, "send the whole file")


def _error_detail(error: Exception) -> str:
    """What FFmpeg says, without the place of the file."""
    said = error.strerror if isinstance(error, av.FFmpegError) else str(error)
    return said or type(error).__name__


def _damaged_error(seconds: float, error: Exception) -> UnreadableSound:
    return UnreadableSound(
        "Damaged sound",
        f"it cannot be read from {seconds:.1f} s on: {_error_detail(error)}",
        "export it anew, or cut it there",
    )


def _detect_format(path: Path) -> str:
    """FFmpeg's name of the file's format, by its first bytes; raises `UnreadableSound`."""
    with path.open("rb") as file:
        head = file.read(12)
        if head[:3] == b"ID3" and len(head) >= 10:
            # a tag before the sound: its size in four times seven bits
            file.seek(10 + (head[6] << 21 | head[7] << 14 | head[8] << 7 | head[9]))
            return "flac" if file.read(4) == b"fLaC" else "mp3"
    if not head:
        raise UnreadableSound("Empty file", "there is not a single byte in it")
    if head[:4] in (b"RIFF", b"RF64") and head[8:] == b"WAVE":
        # FFmpeg makes do with what is there; a byte that fills up may be missing
        said, size = int.from_bytes(head[4:8], "little") + 8, path.stat().st_size
        if said != _UNKNOWN_WAV_SIZE + 8 and size + 1 < said:
            raise _truncated_error(f"the file says that it has {said} bytes and ends after {size}")
        return "wav"
    if head[:4] == b"fLaC":
        return "flac"
    if head[:4] == b"OggS":
        return "ogg"
    if len(head) > 1 and head[0] == 0xFF and head[1] >= 0xE0 and head[1] & 6:
        return "mp3"
    raise UnreadableSound("Not a sound", "this is no sound file of a kind that is read here")
