"""Where strangers' bytes come in, and what must hold of anything that is made of them.

A target takes bytes and says whether they were read (True) or refused (False) with the one error type of its room.
Anything else that comes out of it is a fault. What is read is bounded: a block is less than a megabyte when decoded.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.audio import LARGEST_BLOCK as LARGEST_AUDIO
from bunraku.codec.audio import pack_audio, unpack_audio
from bunraku.codec.coefficients import LARGEST_BLOCK
from bunraku.codec.dancer import LARGEST_DANCER, Dancer
from bunraku.codec.decode import MotionBlock, decode_block
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import MOST_FRAMES, shipped
from bunraku.codec.track import CODEC, MotionTrack, read_track
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Description, unpack
from tests.vectors.blocks import wild
from tests.vectors.golden import FOLDER

LARGEST_DECODED = 1_000_000
"""Bytes that a block may come to."""


def golden(name: str) -> dict[str, Any]:
    """A file of golden vectors."""
    vectors: dict[str, Any] = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    return vectors


def described(track: dict[str, Any]) -> dict[str, Any]:
    """A golden track as a Description has it."""
    numbers = {key: track[key] for key in ("fps", "frames", "block_frames", "first_frames")}
    return numbers | {"type": "motion", "codec": CODEC, "rates": [], "dancer": base64.b64decode(track["dancer"])}


_BLOCKS = golden("blocks.json")
DESCRIBED = [described(track) for track in _BLOCKS["tracks"]]
TRACKS = [read_track(track) for track in DESCRIBED]
BLOCK: bytes = base64.b64decode(_BLOCKS["valid"][0]["block"])


def _decode(track: MotionTrack, data: bytes) -> bool:
    try:
        block = decode_block(track, data)
    except DamagedBlock:
        return False
    count = block.q.shape[2]
    assert len(data) <= LARGEST_BLOCK
    assert block.q.shape == block.values.shape == (19, 3, count)
    assert count <= block.frames <= MOST_FRAMES
    assert block.q.nbytes + block.values.nbytes + block.reference.nbytes <= LARGEST_DECODED
    _tell_apart(block)
    root, rotations = block.at(np.array([-0.5, block.frames / 3, block.frames - 0.5]))
    assert np.isfinite(root).all()
    assert np.allclose(np.linalg.norm(rotations, axis=-1), 1.0)
    return True


def _tell_apart(block: MotionBlock) -> None:
    """Nothing but loops as long as a block is great in one way or another. The coder is compiled, and coverage does not
    see into it; it sees how often these go round."""
    for _ in range(block.frames):
        pass
    for _ in range(block.q.shape[2]):
        pass
    for _ in range(int(np.count_nonzero(block.q))):
        pass
    for _ in range(int(abs(block.q).max(initial=0)).bit_length()):
        pass
    for _ in range(int(np.count_nonzero(block.q.any(axis=(1, 2))))):
        pass


def block(data: bytes) -> bool:
    """A byte that picks a golden track, and a block of it."""
    return bool(data) and _decode(TRACKS[data[0] % len(TRACKS)], data[1:])


def dancer(data: bytes) -> bool:
    """A dancer, and the weights of its limbs."""
    try:
        read = Dancer.unpack(data)
    except DamagedBlock:
        return False
    assert len(data) <= LARGEST_DANCER
    track = MotionTrack(30.0, 30, 30, 30, read)
    assert np.isfinite(track.weights).all()
    assert np.isfinite(track.unweights).all()
    return _decode(track, BLOCK)


def message(data: bytes) -> bool:
    """Any message; the tracks of a Description are read too, and used."""
    try:
        read = unpack(data)
        for track in read.tracks if isinstance(read, Description) else []:
            track_of(track)
    except (MalformedMessage, DamagedBlock):
        return False
    return True


def audio(data: bytes) -> bool:
    """A block of Opus packets."""
    try:
        packets = unpack_audio(data)
    except DamagedBlock:
        return False
    assert sum(len(packet.data) for packet in packets) <= len(data) <= LARGEST_AUDIO
    assert unpack_audio(pack_audio(packets[0].number if packets else 0, [packet.data for packet in packets])) == packets
    return True


def track_of(described: dict[str, Any]) -> MotionTrack:
    """The track of a Description's map, once each of its questions has an answer; raises `DamagedBlock`."""
    track = read_track(described)
    assert track.blocks >= 1
    assert 0 <= track.duration_us < 1 << 48
    last = track.blocks - 1
    assert 1 <= track.frames_in(last) <= MOST_FRAMES
    assert track.block_at(track.start_us(last)) == last
    _decode(track, BLOCK)
    return track


TARGETS: tuple[Callable[[bytes], bool], ...] = (block, dancer, message, audio)


def _longest() -> bytes:
    """A block with as many coefficients as there can be, for the first track."""
    track, q = TRACKS[0], wild(np.random.default_rng(1), MOST_FRAMES, 1)
    return coefficients.encode(shipped(), coefficients.Head(MOST_FRAMES, 99, 1), q, track.block_frames, track.fps)


def seeds() -> list[tuple[int, bytes]]:
    """Golden bytes, valid and broken, each with the number of its target."""
    found = [(0, bytes(1) + _longest())]
    found += [(0, bytes([v["track"]]) + base64.b64decode(v["block"])) for v in _BLOCKS["valid"]]
    found += [(0, bytes(1) + base64.b64decode(v["block"])) for v in _BLOCKS["invalid"]]
    found += [(1, track["dancer"]) for track in DESCRIBED]
    found += [(2, Description("a", [track]).pack()) for track in DESCRIBED]
    messages = golden("messages.json")
    found += [(2, base64.b64decode(v["bytes"])) for v in messages["valid"] + messages["invalid"]]
    sounds = golden("audio.json")
    found += [(3, base64.b64decode(v["block"])) for v in sounds["valid"] + sounds["invalid"]]
    return found
