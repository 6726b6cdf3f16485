"""Audio beside the motion: Opus packets in the motion's own blocks (SPEC.md, Track `audio` and Audio block).

Every packet holds `PACKET` samples, and packet p sounds from sample `PACKET` p - pre-skip on; sample 0 is the motion's
first frame. A packet lies in the block in which it starts. Nothing here makes or decodes a packet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import MAX_DURATION_US, Timing

AUDIO_CODEC = "bunraku.audio/1"
SAMPLE_RATE = 48_000
"""Samples a second, of every track: Opus's own."""
PACKET_SAMPLES = 2_880
"""Samples of a packet: 60 ms."""
MAX_BLOCK_BYTES = 65_536
"""Bytes of a block, at most."""
MAX_PRE_SKIP_SAMPLES = 2 * PACKET_SAMPLES
MAX_LEVELS = 16
MAX_PACKETS = 1 << 28
"""Of a track: what four bytes number."""
_SILK_FRAME_MS = 10, 20, 40, 60
_CELT_FRAME_MS = 2.5, 5, 10, 20


class AudioPacket(NamedTuple):
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
    def packet_count(self) -> int:
        """Packets of each rate."""
        return -(-(self.samples + self.pre_skip) // PACKET_SAMPLES)

    def first_sample(self, number: int) -> int:
        """The sample with which packet `number` starts, at motion time 0 sample 0; of packet 0 it is negative."""
        return PACKET_SAMPLES * number - self.pre_skip

    def block_of_packet(self, number: int) -> int:
        """Index of the block in which packet `number` starts."""
        return self.block_at(self.first_sample(number) * 1e6 / SAMPLE_RATE)


class AudioLevel(NamedTuple):
    """One encoding of a track: its blocks, and their kbit/s over the sound."""

    blocks: list[bytes]
    kbps: float


@dataclass(frozen=True, slots=True)
class EncodedAudio:
    """A sound at every rate, lowest first, upon one track."""

    track: AudioTrack
    ladder: list[AudioLevel]

    def describe(self) -> dict[str, Any]:
        """What a Description says of this track."""
        return describe_audio_track(self.track, [round(rate.kbps, 3) for rate in self.ladder])


def create_audio_track(timing: Timing, channels: int, pre_skip: int, samples: int) -> AudioTrack:
    """The audio track in the blocks of a motion of this `timing`."""
    return AudioTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, channels, pre_skip, samples)


def max_samples(timing: Timing) -> int:
    """Samples that are as long as a motion of this `timing`, the last begun one counted."""
    return -(-timing.duration_us * SAMPLE_RATE // 1_000_000)


def pack_audio_level(track: AudioTrack, packets: Sequence[bytes]) -> AudioLevel:
    """All packets of one rate of `track`, in its blocks. Raises ValueError where they are not as many as the track
    needs, and `DamagedBlock` where one is no packet of 60 ms."""
    if len(packets) != track.packet_count:
        raise ValueError(f"{track.samples} samples are {track.packet_count} packets, not {len(packets)}")
    parts: list[list[bytes]] = [[] for _ in range(track.block_count)]
    firsts = [0] * track.block_count
    for number, packet in enumerate(packets):
        part = parts[index := track.block_of_packet(number)]
        firsts[index] = firsts[index] if part else number
        part.append(packet)
    blocks = [pack_audio_block(first, part) for first, part in zip(firsts, parts, strict=True)]
    return AudioLevel(blocks, sum(map(len, blocks)) * 8e-3 * SAMPLE_RATE / track.samples)


def pack_audio_block(first_number: int, packets: Sequence[bytes]) -> bytes:
    """The block of `packets`, the first of which has number `first`; no bytes where there are none. Raises
    `DamagedBlock` for what `unpack_audio` refuses."""
    if not packets:
        return b""
    parts = [_encode_leb128(first_number)]
    for packet in packets:
        parts += (_encode_leb128(len(packet)), packet)
    block = b"".join(parts)
    unpack_audio_block(block)
    return block


def unpack_audio_block(data: bytes) -> list[AudioPacket]:
    """The packets of one block; raises `DamagedBlock` on what cannot be one."""
    if len(data) > MAX_BLOCK_BYTES:
        raise DamagedBlock(f"an audio block has at most {MAX_BLOCK_BYTES} bytes, not {len(data)}")
    if not data:
        return []
    number, at = _decode_leb128(data, 0)
    packets: list[AudioPacket] = []
    while at < len(data):
        size, at = _decode_leb128(data, at)
        packet = data[at : at + size]
        if size == 0 or len(packet) < size:
            raise DamagedBlock(f"packet {number} of an audio block has {len(packet)} of its {size} bytes")
        if packet_duration_ms(packet) != 60:
            raise DamagedBlock(f"packet {number} of an audio block lasts {packet_duration_ms(packet):g} ms, not 60")
        packets.append(AudioPacket(number, packet))
        number, at = number + 1, at + size
    if not packets or number > MAX_PACKETS:
        raise DamagedBlock("an audio block has packets, numbered below 2^28, or no bytes at all")
    return packets


def packet_duration_ms(packet: bytes) -> float:
    """How long an Opus packet sounds, by its first bytes (RFC 6716, section 3.1)."""
    kind, code = packet[0] >> 3, packet[0] & 3
    if kind < 12:
        frame: float = _SILK_FRAME_MS[kind & 3]
    elif kind < 16:
        frame = _SILK_FRAME_MS[kind & 1]
    else:
        frame = _CELT_FRAME_MS[kind & 3]
    if code < 3:
        return frame * (1 if code == 0 else 2)
    return frame * (packet[1] & 63) if len(packet) > 1 else 0


def describe_audio_track(track: AudioTrack, kbps: Sequence[float]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this audio; its blocks are told by the motion's."""
    return {
        "type": "audio",
        "codec": AUDIO_CODEC,
        "channels": track.channels,
        "pre_skip": track.pre_skip,
        "samples": track.samples,
        "rates": [{"kbps": rate} for rate in kbps],
    }


def parse_audio_track(description: dict[str, Any], motion: Timing) -> AudioTrack:
    """The track of `describe_audio` beside a `motion`; raises `DamagedBlock` where it is not one, or of another
    codec."""
    if description.get("codec") != AUDIO_CODEC:
        raise DamagedBlock(f"the audio is in {description.get('codec')!r}; this reads {AUDIO_CODEC!r}")
    channels, pre_skip, samples = (description.get(key) for key in ("channels", "pre_skip", "samples"))
    if not (isinstance(channels, int) and 1 <= channels <= 2):
        raise DamagedBlock(f"an audio track has 1 or 2 channels, not {channels!r}")
    if not (isinstance(pre_skip, int) and 0 <= pre_skip <= MAX_PRE_SKIP_SAMPLES):
        raise DamagedBlock(f"an audio track has a pre_skip of 0..{MAX_PRE_SKIP_SAMPLES} samples, not {pre_skip!r}")
    if not (isinstance(samples, int) and 0 < samples < MAX_DURATION_US * SAMPLE_RATE // 1_000_000):
        raise DamagedBlock(f"an audio track has samples, one at least, not {samples!r}")
    rates = description.get("rates")
    if not (isinstance(rates, list) and 1 <= len(rates) <= MAX_LEVELS and all(map(_is_level, rates))):
        raise DamagedBlock(f"an audio track has 1..{MAX_LEVELS} rates, each with its kbps")
    return create_audio_track(motion, channels, pre_skip, samples)


def _is_level(rate: Any) -> bool:
    return isinstance(rate, dict) and isinstance(rate.get("kbps"), float | int)


def _encode_leb128(value: int) -> bytes:
    low = []
    while value >> 7:
        low.append(value & 127 | 128)
        value >>= 7
    return bytes([*low, value])


def _decode_leb128(data: bytes, offset: int) -> tuple[int, int]:
    """A whole number of 1 to 4 bytes and where what follows it begins; raises `DamagedBlock`."""
    value = 0
    for shift in (0, 7, 14, 21):
        if offset == len(data):
            break
        byte, offset = data[offset], offset + 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, offset
    raise DamagedBlock("a number in an audio block has 1 to 4 bytes")
