"""Audio blocks, valid and invalid (`audio.json`). Packets have valid first bytes and random contents."""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.codec.audio import (
    AudioTrack,
    create_audio_track,
    describe_audio_track,
    max_samples,
    pack_audio_level,
    unpack_audio_block,
)
from bunraku.codec.timing import Timing
from tests.vectors.blocks import to_base64

PACKET_PREFIXES = b"\x18", b"\x58", b"\xff\x83", b"\xfb\x43"
"""First bytes of packets of 60 ms: one SILK frame, or three CELT frames."""
TIMINGS = (
    Timing(30.0, 78, 30, 15),
    Timing(59.94, 200, 67, 6),
    Timing(128.0, 40, 3, 1),
)
"""Motions with a short first block, with starts between microseconds, and with blocks shorter than a packet."""


def random_packets(count: int, max_bytes: int, seed: int) -> list[bytes]:
    """Return packets of 60 ms and at most about `max_bytes` bytes."""
    random = np.random.default_rng(seed)
    sizes = random.integers(2, max_bytes, count)
    return [PACKET_PREFIXES[random.integers(len(PACKET_PREFIXES))] + random.bytes(int(size)) for size in sizes]


def block_vector(track: AudioTrack, number: int, index: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with the number, first sample and bytes of each packet."""
    return {
        "track": number,
        "index": index,
        "block": to_base64(data),
        "packets": [
            {"number": packet.number, "sample": track.first_sample(packet.number), "data": to_base64(packet.data)}
            for packet in unpack_audio_block(data)
        ],
    }


def make_vectors() -> dict[str, Any]:
    """Return tracks beside motions of several timings, blocks of each, and invalid blocks."""
    tracks = [
        create_audio_track(TIMINGS[0], 2, 120, max_samples(TIMINGS[0])),
        create_audio_track(TIMINGS[1], 1, 312, 100_000),
        create_audio_track(TIMINGS[2], 1, 0, max_samples(TIMINGS[2])),
    ]
    rates = [
        pack_audio_level(track, random_packets(track.packet_count, 3 + 200 * n * n, n))
        for n, track in enumerate(tracks)
    ]
    packet = b"\x18abc"
    invalid = {
        "no packet": b"\x05",
        "no length": b"\x85",
        "an empty packet": b"\x05\x00",
        "a packet cut off": b"\x05\x05" + packet,
        "a length cut off": b"\x05\x04" + packet + b"\x84",
        "a packet of 20 ms": b"\x05\x04\x08abc",
        "a packet of 120 ms": b"\x05\x04\x19abc",
        "a packet without its number of frames": b"\x05\x01\xff",
        "a number of five bytes": b"\x85\x80\x80\x80\x00\x04" + packet,
        "a number too large": b"\xff\xff\xff\x7f\x04" + packet + b"\x04" + packet,
        "too large": b"\x00" + (b"\xff\x7f\x18" + bytes(16_382)) * 4,
    }
    return {
        "motions": [
            {
                "fps": timing.fps,
                "frames": timing.frames,
                "block_frames": timing.block_frames,
                "first_frames": timing.first_frames,
            }
            for timing in TIMINGS
        ],
        "tracks": [
            describe_audio_track(track, [round(rate.kbps, 3)]) for track, rate in zip(tracks, rates, strict=True)
        ],
        "valid": [
            block_vector(track, number, index, block)
            for number, (track, rate) in enumerate(zip(tracks, rates, strict=True))
            for index, block in enumerate(rate.blocks)
        ],
        "invalid": [{"why": why, "block": to_base64(data)} for why, data in invalid.items()],
    }
