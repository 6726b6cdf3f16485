"""Extensions of performers: tracks, blocks, and extended poses (`extension.json`)."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.extension.body_joints import pack_body
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.track import (
    ExtensionTrack,
    decode_extension_block,
    describe_extension_track,
    parse_extension_track,
)
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.timing import plan_timing
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.skeleton import world_transforms
from tests.motion.extended_source import extended_source
from tests.vectors.blocks import encode_header, to_base64

_PARTS = ((3, 1), (0, 0), (1, 0), (4, 1))
"""Joints of the spine and the neck of each source."""


def block_vector(track: ExtensionTrack, number: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with its decoded header, coefficients and values."""
    header, q = coefficients.decode_coefficients(
        load_shipped_prior(), data, track.block_frames, track.fps, track.layout
    )
    instants = (0.0, header.frames / 3 - 0.5, header.frames - 0.5)
    values = decode_extension_block(track, data).values_at(np.array(instants))
    return {
        "track": number,
        "block": to_base64(data),
        "frames": header.frames,
        "step": header.step,
        "q": q.ravel().tolist(),
        "values": [{"instant": t, "numbers": row.ravel().tolist()} for t, row in zip(instants, values, strict=True)],
    }


def pose_vectors(number: int, spine_count: int, neck_count: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the description of a track, and some extended poses of its figure."""
    analysis = analyse(extended_source(40, number, spine_count, neck_count, swing=0.9))
    assert analysis.extension is not None
    motion, extension = analysis.motion, analysis.extension.extension
    timing = plan_timing(motion.fps, motion.frame_count)
    encoded = encode_extension(extension, analysis.extension.values, timing, (6.0, 0.3), number)
    frames = [0, 13, 39]
    placed = world_transforms(motion.figure, motion.root[frames], motion.rotations[frames])
    values = analysis.extension.values[frames]
    pose = extend_pose(motion.figure, extension, *placed, values)
    poses = [
        {
            "track": number,
            "offsets": motion.figure.offsets.ravel().tolist(),
            "root": motion.root[frame].tolist(),
            "rotations": motion.rotations[frame].ravel().tolist(),
            "values": values[index].ravel().tolist(),
            "positions": pose.positions[index].ravel().tolist(),
            "orientations": pose.orientations[index].ravel().tolist(),
            "extra_positions": pose.extra_positions[index].ravel().tolist(),
            "extra_orientations": pose.extra_orientations[index].ravel().tolist(),
        }
        for index, frame in enumerate(frames)
    ]
    blocks = [to_base64(block) for level in encoded.ladder for block in level.blocks]
    joints = to_base64(pack_body(extension))
    return encoded.describe() | {"joints": joints, "blocks": blocks, "names": list(extension.names)}, poses


def load_track(description: dict[str, Any]) -> ExtensionTrack:
    """Return the track of a golden description."""
    return parse_extension_track(description | {"joints": base64.b64decode(description["joints"])})


def make_vectors() -> dict[str, Any]:
    """Return tracks, their blocks, extended poses, and invalid blocks and descriptions."""
    made = [pose_vectors(number, *parts) for number, parts in enumerate(_PARTS)]
    tracks = [load_track(description) for description, _ in made]
    nominal = tracks[0].block_frames
    joints = tracks[0].pack_extension()
    described = describe_extension_track(tracks[0], made[0][0]["rates"]) | {"joints": to_base64(joints)}
    invalid = {
        "no frames": encode_header([(9, 8)], 0, scene=True),
        "more frequencies than frames": encode_header([(9, 8), (5, 3)], 4, scene=True),
        "an escape too long": encode_header([(9, 8), (1, nominal.bit_length())], scene=True) + bytes(30),
    }
    changes: dict[str, dict[str, Any]] = {
        "another codec": {"codec": "bunraku.extension/9"},
        "another part": {"part": "tail"},
        "negative performer": {"performer": -1},
        "five joints of the spine": {"joints": to_base64(bytes([5]) + bytes(30))},
        "no joint": {"joints": to_base64(bytes(19))},
        "an unknown flag": {"joints": to_base64(bytes([33]) + bytes(30))},
        "an integer too large": {"joints": to_base64(joints[:1] + bytes(40))},
        "too long": {"joints": to_base64(joints + bytes(512))},
    }
    return {
        "tracks": [{key: value for key, value in description.items() if key != "blocks"} for description, _ in made],
        "valid": [
            block_vector(tracks[number], number, base64.b64decode(block))
            for number, (description, _) in enumerate(made)
            for block in description["blocks"]
        ],
        "poses": [pose for _, poses in made for pose in poses],
        "invalid": [{"why": why, "block": to_base64(data)} for why, data in invalid.items()],
        "invalid_tracks": [{"why": why, "track": described | change} for why, change in changes.items()],
    }
