"""Fuzzing targets: the decoders of untrusted bytes, and invariants of every decoded value.

A target returns True if it accepts the bytes and False if it rejects them with the one error type of its package. Any
other exception is a failure. Decoded values are bounded: a decoded block takes less than a megabyte.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.audio import MAX_BLOCK_BYTES as LARGEST_AUDIO
from bunraku.codec.audio import pack_audio_block, unpack_audio_block
from bunraku.codec.coefficients import MAX_BLOCK_BYTES
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.body_joints import unpack_body
from bunraku.codec.extension.contact import decode_contact_block, pack_contact_block
from bunraku.codec.extension.face_axes import unpack_face
from bunraku.codec.extension.finger_joints import unpack_fingers
from bunraku.codec.extension.props import decode_prop_block, pack_prop_block
from bunraku.codec.extension.track import Extension, ExtensionTrack, decode_extension_block
from bunraku.codec.motion_decoder import MotionBlock, decode_motion_block
from bunraku.codec.motion_track import MOTION_CODEC, MotionTrack, parse_motion_track
from bunraku.codec.prior import MAX_BLOCK_FRAMES, load_shipped_prior
from bunraku.codec.skeleton_description import MAX_SKELETON_BYTES, SkeletonDescription
from bunraku.motion.extension import BodyExtension, extend_pose
from bunraku.motion.face import MAX_GAZE_RAD, Face, face_expressions
from bunraku.motion.hands import WRISTS, Hands, pose_hands
from bunraku.motion.rotation import IDENTITY, Array
from bunraku.motion.skeleton import JOINT_COUNT, world_transforms
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Description, unpack
from bunraku.wire.prop import MAX_PROPS
from tests.vectors.blocks import random_coefficients
from tests.vectors.golden import VECTORS_FOLDER

MAX_DECODED_BYTES = 1_000_000
"""Maximum size of a decoded block, bytes."""


def load_golden(name: str) -> dict[str, Any]:
    """Load a file of golden vectors."""
    vectors: dict[str, Any] = json.loads((VECTORS_FOLDER / name).read_text(encoding="utf-8"))
    return vectors


def golden_description(track: dict[str, Any]) -> dict[str, Any]:
    """Return the entry of a Description for a golden track."""
    numbers = {key: track[key] for key in ("fps", "frames", "block_frames", "first_frames")}
    return numbers | {"type": "motion", "codec": MOTION_CODEC, "rates": [], "dancer": base64.b64decode(track["dancer"])}


_BLOCKS = load_golden("blocks.json")
TRACK_DESCRIPTIONS = [golden_description(track) for track in _BLOCKS["tracks"]]
TRACKS = [parse_motion_track(track) for track in TRACK_DESCRIPTIONS]
BLOCK: bytes = base64.b64decode(_BLOCKS["valid"][0]["block"])


def _decode(track: MotionTrack, data: bytes) -> bool:
    try:
        block = decode_motion_block(track, data)
    except DamagedBlock:
        return False
    count = block.q.shape[2]
    assert len(data) <= MAX_BLOCK_BYTES
    assert block.q.shape == block.values.shape == (19, 3, count)
    assert count <= block.frames <= MAX_BLOCK_FRAMES
    assert block.q.nbytes + block.values.nbytes + block.reference.nbytes <= MAX_DECODED_BYTES
    _expose_size_to_coverage(block)
    root, rotations = block.pose_at(np.array([-0.5, block.frames / 3, block.frames - 0.5]))
    assert np.isfinite(root).all()
    assert np.allclose(np.linalg.norm(rotations, axis=-1), 1.0)
    return True


def _expose_size_to_coverage(block: MotionBlock) -> None:
    """Run loops whose lengths are the sizes of a block.

    The coder is compiled, so coverage does not see into it; coverage sees how often these loops run.
    """
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
    """Decode a block; the first byte selects the golden track."""
    return bool(data) and _decode(TRACKS[data[0] % len(TRACKS)], data[1:])


def skeleton_description(data: bytes) -> bool:
    """Parse a skeleton description and compute the weights of its channels."""
    try:
        parsed = SkeletonDescription.unpack(data)
    except DamagedBlock:
        return False
    assert len(data) <= MAX_SKELETON_BYTES
    track = MotionTrack(30.0, 30, 30, 30, parsed)
    assert np.isfinite(track.weights).all()
    assert np.isfinite(track.inverse_weights).all()
    return _decode(track, BLOCK)


def message(data: bytes) -> bool:
    """Parse a message; parse and use the tracks of a Description."""
    try:
        parsed = unpack(data)
        for track in parsed.tracks if isinstance(parsed, Description) else []:
            check_track(track)
    except (MalformedMessage, DamagedBlock):
        return False
    return True


def audio(data: bytes) -> bool:
    """Parse a block of Opus packets."""
    try:
        packets = unpack_audio_block(data)
    except DamagedBlock:
        return False
    assert sum(len(packet.data) for packet in packets) <= len(data) <= LARGEST_AUDIO
    assert (
        unpack_audio_block(pack_audio_block(packets[0].number if packets else 0, [packet.data for packet in packets]))
        == packets
    )
    return True


def extension(data: bytes) -> bool:
    """Parse the description of an extension, decode the block that follows, and pose it.

    The first two bytes are its part and its length.
    """
    part, size = data[:2].ljust(2, b"\0")
    described = data[2 : 2 + size]
    extension: Extension
    offsets = np.zeros(0, dtype=np.int64)
    try:
        if part == 0:
            extension = unpack_body(described)
        else:
            extension, offsets = unpack_fingers(described) if part % 2 else unpack_face(described)
        track = ExtensionTrack(30.0, 30, 30, 30, 0, extension, offsets)
        assert np.isfinite(track.weights).all()
        assert np.isfinite(track.inverse_weights).all()
        block = decode_extension_block(track, data[2 + size :])
    except DamagedBlock:
        return False
    assert block.q.nbytes + block.values.nbytes <= MAX_DECODED_BYTES
    values = block.values_at(np.array([-0.5, block.frames - 0.5]))
    assert values.shape == (2, len(track.layout.axes), 3)
    for numbers in _pose_extension(extension, values):
        assert np.isfinite(numbers).all()
    return True


def _pose_extension(extension: Extension, values: Array) -> list[Array]:
    """Return what a viewer draws for the values of an extension; orientations are of length 1."""
    figure = TRACKS[0].figure
    still = np.tile(IDENTITY, (2, JOINT_COUNT, 1))
    placed = world_transforms(figure, np.zeros((2, 3)), still)
    match extension:
        case BodyExtension():
            pose = extend_pose(figure, extension, *placed, values)
            assert np.allclose(np.linalg.norm(pose.extra_orientations, axis=-1), 1.0)
            return list(pose)
        case Hands():
            wrists = list(WRISTS)
            hands = pose_hands(extension, placed[0][:, wrists], placed[1][:, wrists], values)
            assert np.allclose(np.linalg.norm(hands.orientations, axis=-1), 1.0)
            return list(hands)
        case Face():
            weights = face_expressions(extension, values)
            assert np.abs(weights).max() <= MAX_GAZE_RAD
            return [weights]


def check_track(described: dict[str, Any]) -> MotionTrack:
    """Parse a track of a Description and check its timing; raise `DamagedBlock`."""
    track = parse_motion_track(described)
    assert track.block_count >= 1
    assert 0 <= track.duration_us < 1 << 48
    last = track.block_count - 1
    assert 1 <= track.frames_in(last) <= MAX_BLOCK_FRAMES
    assert track.block_at(track.start_us(last)) == last
    _decode(track, BLOCK)
    return track


def contacts(data: bytes) -> bool:
    """Decode a block of contacts. The first two bytes are its number of frames."""
    frames = min(int.from_bytes(data[:2].ljust(2, b"\0"), "little") + 1, MAX_BLOCK_FRAMES)
    try:
        decoded = decode_contact_block(data[2:], frames)
    except DamagedBlock:
        return False
    assert len(pack_contact_block(decoded.planted)) <= len(data[2:])
    return True


def prop(data: bytes) -> bool:
    """Decode a block of props. The first byte is their number, the next two the number of frames."""
    count = 1 + (data[0] if data else 0) % MAX_PROPS
    frames = min(int.from_bytes(data[1:3].ljust(2, b"\0"), "little") + 1, MAX_BLOCK_FRAMES)
    try:
        decoded = decode_prop_block(data[3:], count, frames)
    except DamagedBlock:
        return False
    assert len(pack_prop_block(decoded.states)) <= len(data[3:])
    return True


TARGETS: tuple[Callable[[bytes], bool], ...] = (
    block,
    skeleton_description,
    message,
    audio,
    extension,
    contacts,
    prop,
)


def _largest_block() -> bytes:
    """Return a block of the first track with the maximum number of coefficients."""
    track, q = TRACKS[0], random_coefficients(np.random.default_rng(1), MAX_BLOCK_FRAMES, 1)
    return coefficients.encode_coefficients(
        load_shipped_prior(), coefficients.BlockHeader(MAX_BLOCK_FRAMES, 99, 1), q, track.block_frames, track.fps
    )


def load_seeds() -> list[tuple[int, bytes]]:
    """Return golden bytes, valid and invalid, each with the index of its target."""
    seeds = [(0, bytes(1) + _largest_block())]
    seeds += [(0, bytes([v["track"]]) + base64.b64decode(v["block"])) for v in _BLOCKS["valid"]]
    seeds += [(0, bytes(1) + base64.b64decode(v["block"])) for v in _BLOCKS["invalid"]]
    seeds += [(1, track["dancer"]) for track in TRACK_DESCRIPTIONS]
    seeds += [(2, Description("a", [track]).pack()) for track in TRACK_DESCRIPTIONS]
    messages = load_golden("messages.json")
    seeds += [(2, base64.b64decode(v["bytes"])) for v in messages["valid"] + messages["invalid"]]
    sounds = load_golden("audio.json")
    seeds += [(3, base64.b64decode(v["block"])) for v in sounds["valid"] + sounds["invalid"]]
    extensions = load_golden("extension.json")
    joints = [base64.b64decode(track["joints"]) for track in extensions["tracks"]]
    for vector in [*extensions["valid"], *extensions["invalid"]]:
        described = joints[vector.get("track", 0)]
        seeds.append((4, bytes([0, len(described)]) + described + base64.b64decode(vector["block"])))
    parts = load_golden("hands_face.json")
    for vector in [*parts["valid"], *parts["invalid"]]:
        track = parts["tracks"][vector.get("track", 0)]
        described = base64.b64decode(track.get("joints") or track["axes"])
        part = 1 if track["part"] == "fingers" else 2
        seeds.append((4, bytes([part, len(described)]) + described + base64.b64decode(vector["block"])))
    planted = load_golden("contacts.json")
    for vector in [*planted["valid"], *planted["invalid"]]:
        frames = len(vector["left"]) if "left" in vector else planted["tracks"][0]["block_frames"]
        seeds.append((5, (frames - 1).to_bytes(2, "little") + base64.b64decode(vector["block"])))
    staged = load_golden("props.json")
    for vector in [*staged["valid"], *staged["invalid"]]:
        track = staged["tracks"][vector.get("track", 0)]
        frames = vector.get("frames", track["block_frames"])
        head = bytes([len(track["kinds"]) - 1]) + (frames - 1).to_bytes(2, "little")
        seeds.append((6, head + base64.b64decode(vector["block"])))
    return seeds
