"""Sounds for tests: audio files written by FFmpeg, and an independent decoder for Opus packets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.audio.frame import AudioFrame

Floats = npt.NDArray[np.float64]
AUDIO_FORMATS = {
    "wav": ("wav", "pcm_s16le"),
    "float.wav": ("wav", "pcm_f32le"),
    "flac": ("flac", "flac"),
    "mp3": ("mp3", "libmp3lame"),
    "opus.ogg": ("ogg", "libopus"),
    "vorbis.ogg": ("ogg", "vorbis"),
}
"""FFmpeg's names of format and codec, by the suffix of the file name."""


def write_audio(path: Path, samples: Floats, rate: int, layout: str = "mono") -> Path:
    """Write samples (n, channels) in -1..1. The suffix of `path` selects the format."""
    container_format, codec = AUDIO_FORMATS[path.name.split(".", 1)[1]]
    with av.open(str(path), "w", format=container_format) as container:
        stream: Any = container.add_stream(codec, rate=rate, options={"strict": "experimental"})
        stream.layout = layout
        frame = AudioFrame.from_ndarray(samples.astype(np.float32).reshape(1, -1), "flt", layout)
        frame.sample_rate = rate
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def make_tone(
    seconds: float, rate: int, channels: int = 1, frequency_hz: float = 440.0, amplitude: float = 0.5
) -> Floats:
    """Return a sine wave (n, channels)."""
    wave = amplitude * np.sin(2 * np.pi * frequency_hz * np.arange(round(seconds * rate)) / rate)
    return np.repeat(wave[:, None], channels, axis=1)


def make_click(seconds: float, rate: int, at: float, channels: int = 1, amplitude: float = 0.8) -> Floats:
    """Return silence (n, channels) with a click of some milliseconds at second `at`."""
    elapsed = np.arange(round(seconds * rate)) / rate - at
    wave = np.where(
        elapsed >= 0, amplitude * np.sin(2 * np.pi * 1500 * elapsed) * np.exp(-80 * np.maximum(elapsed, 0)), 0
    )
    return np.repeat(wave[:, None], channels, axis=1)


def find_onset(sound: npt.NDArray[Any], rate: int = 48_000) -> float:
    """Return the time in seconds at which a sound (n,) first exceeds a quarter of its peak."""
    magnitude = np.abs(sound)
    return float(np.argmax(magnitude > 0.25 * magnitude.max()) / rate)


def decode_opus(packets: Iterable[bytes], channels: int = 2) -> Floats:
    """Decode Opus packets with libopus. Return samples (n, channels) at 48 kHz, including the pre-skip."""
    decoder: Any = av.CodecContext.create("libopus", "r")
    decoder.layout, decoder.sample_rate = {1: "mono", 2: "stereo"}[channels], 48_000
    parts: Sequence[Any] = [
        frame.to_ndarray().reshape(-1, channels) for packet in packets for frame in decoder.decode(av.Packet(packet))
    ]
    samples: Floats = np.concatenate(parts) / 32768.0
    return samples
