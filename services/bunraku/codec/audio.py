"""Audio track: Opus packets in the blocks of a motion (proto/codec.md, 2.15).

A packet contains `PACKET_SAMPLES` samples; packet p starts at sample `PACKET_SAMPLES` * p - pre-skip, and sample 0 is
the motion's first frame. A packet is in the block in which it starts. This module neither encodes nor decodes Opus.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.leb128 import decode_leb128, encode_leb128
from bunraku.codec.timing import MAX_DURATION_US, Timing

AUDIO_CODEC = "bunraku.audio/1"
SAMPLE_RATE = 48_000
"""Sample rate of all tracks, which is Opus's own."""
PACKET_SAMPLES = 2_880
"""Samples of a packet: 60 ms."""
MAX_BLOCK_BYTES = 65_536
MAX_PRE_SKIP_SAMPLES = 2 * PACKET_SAMPLES
MAX_LEVELS = 16
"""Limit of the bitrate levels: a Data message has four bits for the level."""
MAX_PACKETS = 1 << 28
"""Limit of the packets of a track: packet numbers are LEB128 of at most four bytes."""
_PACKET_MS = 60
_SILK_FRAME_MS = 10, 20, 40, 60
_CELT_FRAME_MS = 2.5, 5, 10, 20


class AudioPacket(NamedTuple):
    """One Opus packet and its number in the track."""

    number: int
    data: bytes


@dataclass(frozen=True, slots=True)
class AudioTrack(Timing):
    """Constants of an audio track, whose blocks are those of the motion.

    The decoder output has `channels` (1 or 2). Its first `pre_skip` samples are not played, the following `samples`
    are.
    """

    channels: int
    pre_skip: int
    samples: int

    @property
    def kind(self) -> str:
        """Type of the track in the Description."""
        return "audio"

    @property
    def packet_count(self) -> int:
        """Number of packets at each bitrate level."""
        return -(-(self.samples + self.pre_skip) // PACKET_SAMPLES)

    def first_sample(self, number: int) -> int:
        """Return the sample with which packet `number` starts, relative to motion time 0. Packet 0 is negative."""
        return PACKET_SAMPLES * number - self.pre_skip

    def block_of_packet(self, number: int) -> int:
        """Return the index of the block in which packet `number` starts."""
        return self.block_at(self.first_sample(number) * 1e6 / SAMPLE_RATE)


class AudioLevel(NamedTuple):
    """One encoding of an audio track: its blocks and its bitrate."""

    blocks: list[bytes]
    kbps: float


@dataclass(frozen=True, slots=True)
class EncodedAudio:
    """Audio at every bitrate level, lowest first."""

    track: AudioTrack
    ladder: list[AudioLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_audio_track(self.track, [round(level.kbps, 3) for level in self.ladder])


def create_audio_track(timing: Timing, channels: int, pre_skip: int, samples: int) -> AudioTrack:
    """Return an audio track in the blocks of a motion with this timing."""
    return AudioTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, channels, pre_skip, samples)


def max_samples(timing: Timing) -> int:
    """Return the samples of the duration of a motion, rounded up."""
    return -(-timing.duration_us * SAMPLE_RATE // 1_000_000)


def pack_audio_level(track: AudioTrack, packets: Sequence[bytes]) -> AudioLevel:
    """Return one bitrate level of `track` with all its packets.

    Raises:
        ValueError: The number of packets is not that of the track.
        DamagedBlock: A packet does not last 60 ms.
    """
    if len(packets) != track.packet_count:
        raise ValueError(f"Expected {track.packet_count} packets for {track.samples} samples, not {len(packets)}.")
    parts: list[list[bytes]] = [[] for _ in range(track.block_count)]
    firsts = [0] * track.block_count
    for number, packet in enumerate(packets):
        part = parts[index := track.block_of_packet(number)]
        firsts[index] = firsts[index] if part else number
        part.append(packet)
    blocks = [pack_audio_block(first, part) for first, part in zip(firsts, parts, strict=True)]
    return AudioLevel(blocks, sum(map(len, blocks)) * 8e-3 * SAMPLE_RATE / track.samples)


def pack_audio_block(first_number: int, packets: Sequence[bytes]) -> bytes:
    """Return the block of consecutive packets, empty if there are none.

    Raises `DamagedBlock` for packets that `unpack_audio_block` would reject.
    """
    if not packets:
        return b""
    parts = [encode_leb128(first_number)]
    for packet in packets:
        parts += (encode_leb128(len(packet)), packet)
    block = b"".join(parts)
    unpack_audio_block(block)
    return block


def cut_audio(
    track: AudioTrack, ladder: Sequence[Sequence[bytes]], timing: Timing, first_sample: int
) -> EncodedAudio | None:
    """Return the sound from `first_sample` on for a motion with this timing; None if it has ended before.

    The packets keep their bytes, so that nothing is lost. At least one packet before the cut is kept, in the pre-skip:
    in it the decoder converges (RFC 6716, 4.5), and the cut is at the exact sample.

    Args:
        track: Track of the whole sound.
        ladder: Its blocks, by level and index.
        timing: Timing of the motion that is cut out.
        first_sample: Sample of the whole sound with which the cut one begins, at least 0.

    Raises:
        DamagedBlock: A block is damaged.
    """
    samples = min(track.samples - first_sample, max_samples(timing))
    if samples <= 0:
        return None
    first_packet = max((first_sample + track.pre_skip) // PACKET_SAMPLES - 1, 0)
    pre_skip = first_sample + track.pre_skip - PACKET_SAMPLES * first_packet
    cut = create_audio_track(timing, track.channels, pre_skip, samples)
    levels = []
    for blocks in ladder:
        packets = [packet.data for block in blocks for packet in unpack_audio_block(block)]
        levels.append(pack_audio_level(cut, packets[first_packet : first_packet + cut.packet_count]))
    return EncodedAudio(cut, levels)


def unpack_audio_block(data: bytes) -> list[AudioPacket]:
    """Return the packets of one block. Raises `DamagedBlock`."""
    if len(data) > MAX_BLOCK_BYTES:
        raise DamagedBlock(f"Invalid audio block: {len(data)} bytes, at most {MAX_BLOCK_BYTES} are allowed.")
    if not data:
        return []
    number, offset = decode_leb128(data, 0)
    packets: list[AudioPacket] = []
    while offset < len(data):
        length, offset = decode_leb128(data, offset)
        packet = data[offset : offset + length]
        if length == 0 or len(packet) < length:
            raise DamagedBlock(f"Invalid audio block: packet {number} has {len(packet)} of {length} bytes.")
        duration = packet_duration_ms(packet)
        if duration != _PACKET_MS:
            raise DamagedBlock(f"Invalid audio block: packet {number} lasts {duration:g} ms, not {_PACKET_MS}.")
        packets.append(AudioPacket(number, packet))
        number, offset = number + 1, offset + length
    if not packets or number > MAX_PACKETS:
        raise DamagedBlock("Invalid audio block: expected packets with numbers below 2^28, or no bytes at all.")
    return packets


def packet_duration_ms(packet: bytes) -> float:
    """Return the duration of an Opus packet from its first bytes (RFC 6716, section 3.1)."""
    configuration, code = packet[0] >> 3, packet[0] & 3
    if configuration < 12:
        frame: float = _SILK_FRAME_MS[configuration & 3]
    elif configuration < 16:
        frame = _SILK_FRAME_MS[configuration & 1]
    else:
        frame = _CELT_FRAME_MS[configuration & 3]
    if code < 3:
        return frame * (1 if code == 0 else 2)
    return frame * (packet[1] & 63) if len(packet) > 1 else 0


def describe_audio_track(track: AudioTrack, kbps: Sequence[float]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for audio. The motion's entry describes the blocks."""
    return {
        "type": "audio",
        "codec": AUDIO_CODEC,
        "channels": track.channels,
        "pre_skip": track.pre_skip,
        "samples": track.samples,
        "rates": [{"kbps": bitrate} for bitrate in kbps],
    }


def parse_audio_track(description: dict[str, Any], motion: Timing) -> AudioTrack:
    """Return the track of `describe_audio_track` for a motion.

    Raises `DamagedBlock` if it is invalid or of another codec.
    """
    if description.get("codec") != AUDIO_CODEC:
        raise DamagedBlock(f"Unsupported audio codec {description.get('codec')!r}, expected {AUDIO_CODEC!r}.")
    channels, pre_skip, samples = (description.get(key) for key in ("channels", "pre_skip", "samples"))
    if not (isinstance(channels, int) and 1 <= channels <= 2):
        raise DamagedBlock(f"Invalid audio track: channels must be 1 or 2, not {channels!r}.")
    if not (isinstance(pre_skip, int) and 0 <= pre_skip <= MAX_PRE_SKIP_SAMPLES):
        raise DamagedBlock(f"Invalid audio track: pre_skip must be 0..{MAX_PRE_SKIP_SAMPLES}, not {pre_skip!r}.")
    if not (isinstance(samples, int) and 0 < samples < MAX_DURATION_US * SAMPLE_RATE // 1_000_000):
        raise DamagedBlock(f"Invalid audio track: samples must be at least 1 and less than 2^48 us, not {samples!r}.")
    rates = description.get("rates")
    if not (isinstance(rates, list) and 1 <= len(rates) <= MAX_LEVELS and all(map(_is_level, rates))):
        raise DamagedBlock(f"Invalid audio track: rates must have 1..{MAX_LEVELS} entries, each with kbps, a number.")
    return create_audio_track(motion, channels, pre_skip, samples)


def _is_level(entry: Any) -> bool:
    return isinstance(entry, dict) and isinstance(entry.get("kbps"), float | int)
