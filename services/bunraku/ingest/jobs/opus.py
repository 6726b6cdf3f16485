"""Sound to Opus packets at several rates at once (RFC 6716, through FFmpeg's libopus)."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Any

import av
import numpy as np
from av.audio.codeccontext import AudioCodecContext
from av.audio.frame import AudioFrame

from bunraku.codec.audio import PACKET_SAMPLES, SAMPLE_RATE, EncodedAudio, create_audio_track, pack_audio_level
from bunraku.codec.timing import Timing
from bunraku.ingest.jobs.sound_file import Samples

BITRATE_LADDERS: dict[int, tuple[tuple[float, int], ...]] = {
    1: ((9.0, 1), (20.0, 1), (40.0, 1)),
    2: ((9.0, 1), (24.0, 2), (64.0, 2)),
}
"""By the sound's channels: kbit/s and channels of each rate, lowest first (NOTES.md says why)."""
_ENCODER_OPTIONS = {
    "frame_duration": "60",
    # its transform alone, which is kinder to music at few bits than the model of a voice, and starts sooner
    "application": "lowdelay",
    # a narrow line feels every peak
    "vbr": "constrained",
}
_CHANNEL_LAYOUTS = {1: "mono", 2: "stereo"}


def encode_audio(pieces: Iterable[Samples], timing: Timing, channels: int) -> EncodedAudio:
    """The sound, samples (n, channels) piece by piece, as the audio track of a motion of this `timing`, which it is no
    longer than. Raises ValueError for a sound without a sample."""
    encoders = [_OpusEncoder(kbps, out) for kbps, out in BITRATE_LADDERS[channels]]
    samples = 0
    for packet in _split_into_packets(pieces):
        samples += len(packet)
        for encoder in encoders:
            encoder.encode(packet)
    if samples == 0:
        raise ValueError("a sound has one sample at least")
    track = create_audio_track(timing, channels, encoders[0].pre_skip, samples)
    return EncodedAudio(track, [pack_audio_level(track, encoder.flush()) for encoder in encoders])


def _split_into_packets(samples: Iterable[Samples]) -> Iterator[Samples]:
    """The same sound in pieces of a packet, the last perhaps shorter."""
    waiting: list[Samples] = []
    size = 0
    for piece in samples:
        waiting.append(piece)
        size += len(piece)
        if size >= PACKET_SAMPLES:
            joined = np.concatenate(waiting)
            whole = size - size % PACKET_SAMPLES
            yield from np.split(joined[:whole], whole // PACKET_SAMPLES)
            waiting, size = [joined[whole:]], size - whole
    if size:
        yield np.concatenate(waiting)


class _OpusEncoder:
    """One rate: packets of 60 ms, `channels` of them from whatever comes."""

    def __init__(self, kbps: float, channels: int) -> None:
        context: Any = av.CodecContext.create("libopus", "w")
        assert isinstance(context, AudioCodecContext)
        context.sample_rate = SAMPLE_RATE
        context.layout = _CHANNEL_LAYOUTS[channels]
        context.format = "flt"
        context.bit_rate = round(kbps * 1000)
        context.options = _ENCODER_OPTIONS
        context.open()
        # RFC 7845, section 5.1: its identification header
        (self.pre_skip,) = struct.unpack_from("<H", bytes(context.extradata or b""), 10)
        self._context = context
        self._channels = channels
        self._packets: list[bytes] = []
        self._sent_samples = 0

    def encode(self, samples: Samples) -> None:
        """Encode the samples of one packet; of the last there may be fewer."""
        mixed = samples.mean(axis=1, keepdims=True) if self._channels < samples.shape[1] else samples
        frame = AudioFrame.from_ndarray(
            np.ascontiguousarray(mixed, dtype=np.float32).reshape(1, -1), "flt", _CHANNEL_LAYOUTS[self._channels]
        )
        frame.sample_rate = SAMPLE_RATE
        frame.pts = self._sent_samples
        self._sent_samples += len(samples)
        self._packets += map(bytes, self._context.encode(frame))

    def flush(self) -> list[bytes]:
        """All packets, the last filled up with silence."""
        self._packets += map(bytes, self._context.encode(None))
        return self._packets
