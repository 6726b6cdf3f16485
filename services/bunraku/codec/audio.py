"""Audio beside the motion: Opus packets in the motion's own blocks (SPEC.md, Track `audio` and Audio block).

Every packet holds `PACKET` samples, and packet p sounds from sample `PACKET` p - pre-skip on; sample 0 is the motion's
first frame. A packet lies in the block in which it starts. Nothing here makes or decodes a packet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import MOST_US, Timing

CODEC = "bunraku.audio/1"
SAMPLE_RATE = 48_000
"""Samples a second, of every track: Opus's own."""
PACKET = 2_880
"""Samples of a packet: 60 ms."""
LARGEST_BLOCK = 65_536
"""Bytes of a block, at most."""
MOST_PRE_SKIP = 2 * PACKET
MOST_RATES = 16
MOST_PACKETS = 1 << 28
"""Of a track: what four bytes number."""
_SILK_MS = 10, 20, 40, 60
_CELT_MS = 2.5, 5, 10, 20


class Packet(NamedTuple):
    """One Opus packet: its number in the track, and its bytes."""

    number: int
    data: bytes


@dataclass(frozen=True, slots=True)
class AudioTrack(Timing):
    """Constants of an audio track, whose blocks are the motion's: `channels` (1 or 2) to decode to, `pre_skip` samples
    that come out of a decoder before the first, and `samples` of sound in all, after which there is silence."""

    channels: int
    pre_skip: int
    samples: int

    @property
    def kind(self) -> str:
        """The track's type."""
        return "audio"

    @property
    def packets(self) -> int:
        """Packets of each rate."""
        return -(-(self.samples + self.pre_skip) // PACKET)

    def first_sample(self, number: int) -> int:
        """The sample with which packet `number` starts, at motion time 0 sample 0; of packet 0 it is negative."""
        return PACKET * number - self.pre_skip

    def block_of(self, number: int) -> int:
        """Index of the block in which packet `number` starts."""
        return self.block_at(self.first_sample(number) * 1e6 / SAMPLE_RATE)


class AudioRate(NamedTuple):
    """One encoding of a track: its blocks, and their kbit/s over the sound."""

    blocks: list[bytes]
    kbps: float


@dataclass(frozen=True, slots=True)
class EncodedAudio:
    """A sound at every rate, lowest first, upon one track."""

    track: AudioTrack
    rates: list[AudioRate]

    def describe(self) -> dict[str, Any]:
        """What a Description says of this track."""
        return describe_audio(self.track, [round(rate.kbps, 3) for rate in self.rates])


def audio_track(timing: Timing, channels: int, pre_skip: int, samples: int) -> AudioTrack:
    """The audio track in the blocks of a motion of this `timing`."""
    return AudioTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, channels, pre_skip, samples)


def most_samples(timing: Timing) -> int:
    """Samples that are as long as a motion of this `timing`, the last begun one counted."""
    return -(-timing.duration_us * SAMPLE_RATE // 1_000_000)


def in_blocks(track: AudioTrack, packets: Sequence[bytes]) -> AudioRate:
    """All packets of one rate of `track`, in its blocks. Raises ValueError where they are not as many as the track
    needs, and `DamagedBlock` where one is no packet of 60 ms."""
    if len(packets) != track.packets:
        raise ValueError(f"{track.samples} samples are {track.packets} packets, not {len(packets)}")
    parts: list[list[bytes]] = [[] for _ in range(track.blocks)]
    firsts = [0] * track.blocks
    for number, packet in enumerate(packets):
        part = parts[index := track.block_of(number)]
        firsts[index] = firsts[index] if part else number
        part.append(packet)
    blocks = [pack_audio(first, part) for first, part in zip(firsts, parts, strict=True)]
    return AudioRate(blocks, sum(map(len, blocks)) * 8e-3 * SAMPLE_RATE / track.samples)


def pack_audio(first: int, packets: Sequence[bytes]) -> bytes:
    """The block of `packets`, the first of which has number `first`; no bytes where there are none. Raises
    `DamagedBlock` for what `unpack_audio` refuses."""
    if not packets:
        return b""
    parts = [_leb128(first)]
    for packet in packets:
        parts += (_leb128(len(packet)), packet)
    block = b"".join(parts)
    unpack_audio(block)
    return block


def unpack_audio(data: bytes) -> list[Packet]:
    """The packets of one block; raises `DamagedBlock` on what cannot be one."""
    if len(data) > LARGEST_BLOCK:
        raise DamagedBlock(f"an audio block has at most {LARGEST_BLOCK} bytes, not {len(data)}")
    if not data:
        return []
    number, at = _read_leb128(data, 0)
    packets: list[Packet] = []
    while at < len(data):
        size, at = _read_leb128(data, at)
        packet = data[at : at + size]
        if size == 0 or len(packet) < size:
            raise DamagedBlock(f"packet {number} of an audio block has {len(packet)} of its {size} bytes")
        if milliseconds(packet) != 60:
            raise DamagedBlock(f"packet {number} of an audio block lasts {milliseconds(packet):g} ms, not 60")
        packets.append(Packet(number, packet))
        number, at = number + 1, at + size
    if not packets or number > MOST_PACKETS:
        raise DamagedBlock("an audio block has packets, numbered below 2^28, or no bytes at all")
    return packets


def milliseconds(packet: bytes) -> float:
    """How long an Opus packet sounds, by its first bytes (RFC 6716, section 3.1)."""
    kind, code = packet[0] >> 3, packet[0] & 3
    if kind < 12:
        frame: float = _SILK_MS[kind & 3]
    elif kind < 16:
        frame = _SILK_MS[kind & 1]
    else:
        frame = _CELT_MS[kind & 3]
    if code < 3:
        return frame * (1 if code == 0 else 2)
    return frame * (packet[1] & 63) if len(packet) > 1 else 0


def describe_audio(track: AudioTrack, kbps: Sequence[float]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this audio; its blocks are told by the motion's."""
    return {
        "type": "audio",
        "codec": CODEC,
        "channels": track.channels,
        "pre_skip": track.pre_skip,
        "samples": track.samples,
        "rates": [{"kbps": rate} for rate in kbps],
    }


def read_audio(described: dict[str, Any], motion: Timing) -> AudioTrack:
    """The track of `describe_audio` beside a `motion`; raises `DamagedBlock` where it is not one, or of another
    codec."""
    if described.get("codec") != CODEC:
        raise DamagedBlock(f"the audio is in {described.get('codec')!r}; this reads {CODEC!r}")
    channels, pre_skip, samples = (described.get(key) for key in ("channels", "pre_skip", "samples"))
    if not (isinstance(channels, int) and 1 <= channels <= 2):
        raise DamagedBlock(f"an audio track has 1 or 2 channels, not {channels!r}")
    if not (isinstance(pre_skip, int) and 0 <= pre_skip <= MOST_PRE_SKIP):
        raise DamagedBlock(f"an audio track has a pre_skip of 0..{MOST_PRE_SKIP} samples, not {pre_skip!r}")
    if not (isinstance(samples, int) and 0 < samples < MOST_US * SAMPLE_RATE // 1_000_000):
        raise DamagedBlock(f"an audio track has samples, one at least, not {samples!r}")
    rates = described.get("rates")
    if not (isinstance(rates, list) and 1 <= len(rates) <= MOST_RATES and all(map(_is_rate, rates))):
        raise DamagedBlock(f"an audio track has 1..{MOST_RATES} rates, each with its kbps")
    return audio_track(motion, channels, pre_skip, samples)


def _is_rate(rate: Any) -> bool:
    return isinstance(rate, dict) and isinstance(rate.get("kbps"), float | int)


def _leb128(value: int) -> bytes:
    low = []
    while value >> 7:
        low.append(value & 127 | 128)
        value >>= 7
    return bytes([*low, value])


def _read_leb128(data: bytes, at: int) -> tuple[int, int]:
    """A whole number of 1 to 4 bytes and where what follows it begins; raises `DamagedBlock`."""
    value = 0
    for shift in (0, 7, 14, 21):
        if at == len(data):
            break
        byte, at = data[at], at + 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
    raise DamagedBlock("a number in an audio block has 1 to 4 bytes")
