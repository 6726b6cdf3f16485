"""Sound to Opus packets at several rates at once (RFC 6716, through FFmpeg's libopus)."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Any

import av
import numpy as np
from av.audio.codeccontext import AudioCodecContext
from av.audio.frame import AudioFrame

from bunraku.codec.audio import PACKET, SAMPLE_RATE, EncodedAudio, audio_track, in_blocks
from bunraku.codec.timing import Timing
from bunraku.ingest.sound import Samples

LADDERS: dict[int, tuple[tuple[float, int], ...]] = {
    1: ((9.0, 1), (20.0, 1), (40.0, 1)),
    2: ((9.0, 1), (24.0, 2), (64.0, 2)),
}
"""By the sound's channels: kbit/s and channels of each rate, lowest first (NOTES.md says why)."""
_OPTIONS = {
    "frame_duration": "60",
    # its transform alone, which is kinder to music at few bits than the model of a voice, and starts sooner
    "application": "lowdelay",
    # a narrow line feels every peak
    "vbr": "constrained",
}
_LAYOUTS = {1: "mono", 2: "stereo"}


def encode_audio(sound: Iterable[Samples], timing: Timing, channels: int) -> EncodedAudio:
    """The sound, samples (n, channels) piece by piece, as the audio track of a motion of this `timing`, which it is no
    longer than. Raises ValueError for a sound without a sample."""
    encoders = [_Encoder(kbps, out) for kbps, out in LADDERS[channels]]
    samples = 0
    for packet in _packets(sound):
        samples += len(packet)
        for encoder in encoders:
            encoder.put(packet)
    if samples == 0:
        raise ValueError("a sound has one sample at least")
    track = audio_track(timing, channels, encoders[0].pre_skip, samples)
    return EncodedAudio(track, [in_blocks(track, encoder.end()) for encoder in encoders])


def _packets(sound: Iterable[Samples]) -> Iterator[Samples]:
    """The same sound in pieces of a packet, the last perhaps shorter."""
    waiting: list[Samples] = []
    size = 0
    for piece in sound:
        waiting.append(piece)
        size += len(piece)
        if size >= PACKET:
            joined = np.concatenate(waiting)
            whole = size - size % PACKET
            yield from np.split(joined[:whole], whole // PACKET)
            waiting, size = [joined[whole:]], size - whole
    if size:
        yield np.concatenate(waiting)


class _Encoder:
    """One rate: packets of 60 ms, `channels` of them from whatever comes."""

    def __init__(self, kbps: float, channels: int) -> None:
        context: Any = av.CodecContext.create("libopus", "w")
        assert isinstance(context, AudioCodecContext)
        context.sample_rate = SAMPLE_RATE
        context.layout = _LAYOUTS[channels]
        context.format = "flt"
        context.bit_rate = round(kbps * 1000)
        context.options = _OPTIONS
        context.open()
        # RFC 7845, section 5.1: its identification header
        (self.pre_skip,) = struct.unpack_from("<H", bytes(context.extradata or b""), 10)
        self._context = context
        self._channels = channels
        self._packets: list[bytes] = []
        self._sent = 0

    def put(self, samples: Samples) -> None:
        """Encode the samples of one packet; of the last there may be fewer."""
        mixed = samples.mean(axis=1, keepdims=True) if self._channels < samples.shape[1] else samples
        frame = AudioFrame.from_ndarray(
            np.ascontiguousarray(mixed, dtype=np.float32).reshape(1, -1), "flt", _LAYOUTS[self._channels]
        )
        frame.sample_rate = SAMPLE_RATE
        frame.pts = self._sent
        self._sent += len(samples)
        self._packets += map(bytes, self._context.encode(frame))

    def end(self) -> list[bytes]:
        """All packets, the last filled up with silence."""
        self._packets += map(bytes, self._context.encode(None))
        return self._packets
