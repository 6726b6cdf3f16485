"""Blocks of live performers, and the poses that a viewer shows of their messages (`live.json`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.live import LIVE_FPS, LiveTrack
from bunraku.codec.motion_track import MotionTrack, describe_motion_track
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.codec.skeleton_description import SkeletonDescription, snap_to_grid
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, standard_figure
from bunraku.playout.live_buffer import LiveBuffer
from bunraku.playout.track_set import TrackSet
from bunraku.wire.live import Live, LiveBlock
from bunraku.wire.messages import Description
from tests.vectors.blocks import encode_header, random_coefficients, to_base64
from tests.vectors.messages import NOW_US
from tests.vectors.playback import LADDER, MOTION, PLACES

FRAME_US = Live.FRAME_INTERVAL_US
STEP = 148
SHOWN_FRAMES = (
    *(-0.5, 0.0, 0.25, 1.0, 2.5, 3.0, 4.1, 5.0, 6.5, 7.75, 9.0, 10.2, 12.6, 13.0),
    *(20.0, 38.5, 39.5, 42.5, 45.0, 70.0, 70.75, 71.0, 90.0, 110.0),
)
"""Frames and instants between them; before the first, within the hold of 500 ms (30 frames), and after it."""


def make_live_track(dancer: bytes) -> LiveTrack:
    """Return the track of a performer with a packed skeleton description."""
    return LiveTrack(SkeletonDescription.unpack(dancer))


def _skeleton(random: np.random.Generator) -> SkeletonDescription:
    reference = random.integers(-2, 3, (JOINT_COUNT, 3)).astype(np.float64)
    return SkeletonDescription(snap_to_grid(standard_figure(), 2), 2, reference, 2)


def _encode(frames: int, step: int, heading: int, q: IntArray) -> bytes:
    return coefficients.encode_coefficients(
        load_shipped_prior(), BlockHeader(frames, step, heading), q, frames, LIVE_FPS
    )


def _smooth(random: np.random.Generator, frames: int) -> bytes:
    """Return a block of small movements near the reference."""
    falloff = np.array([9.0, 3.0])[:frames]
    q: IntArray = np.round(random.normal(0.0, 1.0, (CHANNEL_COUNT, 3, len(falloff))) * falloff).astype(np.int64)
    return _encode(frames, STEP, -3, q)


def _block_vector(track: LiveTrack, frames: int, data: bytes) -> dict[str, Any]:
    header, q = coefficients.decode_coefficients(load_shipped_prior(), data, frames, LIVE_FPS)
    roots, rotations = track.decode(frames, data).pose_at(np.arange(frames, dtype=np.float64))
    return {
        "frames": frames,
        "block": to_base64(data),
        "step": header.step,
        "heading": header.heading,
        "q": q.ravel().tolist(),
        "poses": [
            {"root": root.tolist(), "rotations": pose.ravel().tolist()}
            for root, pose in zip(roots, rotations, strict=True)
        ],
    }


def _blocks(skeleton: SkeletonDescription, random: np.random.Generator) -> dict[str, Any]:
    track = LiveTrack(skeleton)
    blocks = [(frames, _smooth(random, frames)) for frames in (1, 2, 3, 4, 16)]
    for frames, step, heading, count, max_magnitude in ((1, 0, 31, 1, 3), (2, 255, -32, 0, 1), (2, 130, 0, 2, 1 << 16)):
        blocks.append((frames, _encode(frames, step, heading, random_coefficients(random, count, max_magnitude))))
    blocks.append(
        (
            2,
            coefficients.encode_coefficients(
                load_shipped_prior(), BlockHeader(2, STEP, 5), random_coefficients(random, 1, 9), 4, LIVE_FPS
            ),
        )
    )
    rest = [(9, 8), (32, 6)]
    invalid = {
        "empty: more frequencies than frames": (2, b""),
        "fewer frames than the message": (2, encode_header([*rest, (1, 1)], 1)),
        "more frames than the message": (2, encode_header([*rest, (1, 2)], 3)),
        "more frequencies than frames": (2, encode_header([*rest, (3, 2)])),
        "an escape too long": (2, encode_header([*rest, (1, 2)]) + bytes(30)),
    }
    return {
        "valid": [_block_vector(track, frames, data) for frames, data in blocks],
        "invalid": [
            {"why": why, "frames": frames, "block": to_base64(data)} for why, (frames, data) in invalid.items()
        ],
    }


def _messages(random: np.random.Generator) -> list[Live]:
    """Return messages in the order of arrival: late, repeated, skipped, of either or both performers, and a gap."""

    def live(last_frame: int, frames: int, *performers: int) -> Live:
        blocks = {number: LiveBlock(40_000, _smooth(random, frames)) for number in performers}
        return Live(NOW_US + last_frame * FRAME_US, frames, blocks)

    fifth = live(9, 2, 0, 1)
    return [
        live(1, 2, 0),
        live(5, 2, 0, 1),
        # the message before the last one
        live(3, 2, 0, 1),
        fifth,
        fifth,
        # the same instants once more: the first poses stay
        live(9, 2, 0),
        live(13, 4, 1),
        # more than 500 ms later
        live(70, 1, 0),
        live(71, 1, 0),
        Live(NOW_US + 73 * FRAME_US, 2, {}),
    ]


def _shows(skeletons: list[SkeletonDescription], random: np.random.Generator) -> dict[str, Any]:
    # a second of the rest pose, which live poses replace
    tracks = [MotionTrack(30.0, 30, 30, 30, skeleton) for skeleton in skeletons]
    entries = [
        {**describe_motion_track(track, LADDER), "place": place} for track, place in zip(tracks, PLACES, strict=True)
    ]
    description = Description(MOTION, entries)
    placements = TrackSet(description.tracks).placements
    buffers = [LiveBuffer(LiveTrack(skeleton)) for skeleton in skeletons]
    messages = _messages(random)
    for message in messages:
        for performer, block in message.blocks.items():
            buffers[performer].put(message.due, message.frames, block.data)
    poses = []
    for frame in SHOWN_FRAMES:
        clock = NOW_US + round(frame * FRAME_US)
        performers: list[dict[str, Any] | None] = []
        for buffer, placement in zip(buffers, placements, strict=True):
            pose = buffer.pose_at(clock)
            if pose is None:
                performers.append(None)
                continue
            root, rotations = placement.apply(*pose)
            performers.append({"root": root.tolist(), "rotations": rotations.ravel().tolist()})
        poses.append({"clock": clock, "performers": performers})
    return {
        "description": to_base64(description.pack()),
        "messages": [to_base64(message.pack()) for message in messages],
        "poses": poses,
    }


def make_vectors() -> dict[str, Any]:
    """Return live blocks with coefficients and poses, invalid ones, and Live messages with the poses on the stage."""
    random = np.random.default_rng(31)
    skeletons = [_skeleton(random) for _ in range(2)]
    return {
        "dancer": to_base64(skeletons[0].pack()),
        **_blocks(skeletons[0], random),
        "show": _shows(skeletons, random),
    }
