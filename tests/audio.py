"""Sounds for tests: files made by FFmpeg, and what is heard in the packets that were made of them."""

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
"""How a file's name ends: FFmpeg's names of its format and codec."""


def write_audio(path: Path, samples: Floats, rate: int, layout: str = "mono") -> Path:
    """The samples (n, channels), -1..1, as the file that the name of `path` says."""
    form, codec = AUDIO_FORMATS[path.name.split(".", 1)[1]]
    with av.open(str(path), "w", format=form) as container:
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
    """A sine (n, channels)."""
    wave = amplitude * np.sin(2 * np.pi * frequency_hz * np.arange(round(seconds * rate)) / rate)
    return np.repeat(wave[:, None], channels, axis=1)


def make_click(seconds: float, rate: int, at: float, channels: int = 1, amplitude: float = 0.8) -> Floats:
    """Silence, and from second `at` on a beat of some milliseconds."""
    since = np.arange(round(seconds * rate)) / rate - at
    wave = np.where(since >= 0, amplitude * np.sin(2 * np.pi * 1500 * since) * np.exp(-80 * np.maximum(since, 0)), 0)
    return np.repeat(wave[:, None], channels, axis=1)


def find_onset(sound: npt.NDArray[Any], rate: int = 48_000) -> float:
    """The second at which a sound (n,) comes up to a quarter of its peak."""
    loud = np.abs(sound)
    return float(np.argmax(loud > 0.25 * loud.max()) / rate)


def decode_opus(packets: Iterable[bytes], channels: int = 2) -> Floats:
    """Opus packets by a decoder of its own: samples (n, channels) at 48 kHz, pre-skip and all."""
    decoder: Any = av.CodecContext.create("libopus", "r")
    decoder.layout, decoder.sample_rate = {1: "mono", 2: "stereo"}[channels], 48_000
    parts: Sequence[Any] = [
        frame.to_ndarray().reshape(-1, channels) for packet in packets for frame in decoder.decode(av.Packet(packet))
    ]
    heard: Floats = np.concatenate(parts) / 32768.0
    return heard
