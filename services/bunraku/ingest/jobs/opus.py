"""Encoding of sound as Opus at several bitrates (RFC 6716, with FFmpeg's libopus)."""

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
"""Bitrate (kbit/s) and channels of each level, lowest first, by channels of the sound (`proto/NOTES.md`)."""
_ENCODER_OPTIONS = {
    "frame_duration": "60",
    # CELT only: better than the speech model for music at low bitrates, and with a shorter pre-skip
    "application": "lowdelay",
    # no bitrate peaks, which delay other data on a constrained link
    "vbr": "constrained",
}
_CHANNEL_LAYOUTS = {1: "mono", 2: "stereo"}


def encode_audio(chunks: Iterable[Samples], timing: Timing, channels: int) -> EncodedAudio:
    """Encode chunks of samples, (n, channels), as the audio track of a motion with this `timing`.

    The sound must not be longer than the motion. Raise ValueError for a sound without samples.
    """
    encoders = [_OpusEncoder(kbps, level_channels) for kbps, level_channels in BITRATE_LADDERS[channels]]
    samples = 0
    for packet in _split_into_packets(chunks):
        samples += len(packet)
        for encoder in encoders:
            encoder.encode(packet)
    if samples == 0:
        raise ValueError("the sound must have at least one sample")
    track = create_audio_track(timing, channels, encoders[0].pre_skip, samples)
    return EncodedAudio(track, [pack_audio_level(track, encoder.flush()) for encoder in encoders])


def _split_into_packets(chunks: Iterable[Samples]) -> Iterator[Samples]:
    """Split the sound into chunks of one packet; the last may be shorter."""
    pending: list[Samples] = []
    size = 0
    for chunk in chunks:
        pending.append(chunk)
        size += len(chunk)
        if size >= PACKET_SAMPLES:
            joined = np.concatenate(pending)
            complete = size - size % PACKET_SAMPLES
            yield from np.split(joined[:complete], complete // PACKET_SAMPLES)
            pending, size = [joined[complete:]], size - complete
    if size:
        yield np.concatenate(pending)


class _OpusEncoder:
    """Encoder of one bitrate level, with packets of 60 ms and a mono or stereo mix of the input."""

    def __init__(self, kbps: float, channels: int) -> None:
        context: Any = av.CodecContext.create("libopus", "w")
        assert isinstance(context, AudioCodecContext)
        context.sample_rate = SAMPLE_RATE
        context.layout = _CHANNEL_LAYOUTS[channels]
        context.format = "flt"
        context.bit_rate = round(kbps * 1000)
        context.options = _ENCODER_OPTIONS
        context.open()
        # identification header (RFC 7845, section 5.1)
        (self.pre_skip,) = struct.unpack_from("<H", bytes(context.extradata or b""), 10)
        self._context = context
        self._channels = channels
        self._packets: list[bytes] = []
        self._sent_samples = 0

    def encode(self, samples: Samples) -> None:
        """Encode the samples of one packet; only the last may have fewer."""
        mixed = samples.mean(axis=1, keepdims=True) if self._channels < samples.shape[1] else samples
        frame = AudioFrame.from_ndarray(
            np.ascontiguousarray(mixed, dtype=np.float32).reshape(1, -1), "flt", _CHANNEL_LAYOUTS[self._channels]
        )
        frame.sample_rate = SAMPLE_RATE
        frame.pts = self._sent_samples
        self._sent_samples += len(samples)
        self._packets += map(bytes, self._context.encode(frame))

    def flush(self) -> list[bytes]:
        """Return all packets, the last one padded with silence."""
        self._packets += map(bytes, self._context.encode(None))
        return self._packets
