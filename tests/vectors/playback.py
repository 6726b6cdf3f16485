"""A stream from its messages to poses on the stage (`playback.json`).

Two performers, the second shorter, at different places; poses within blocks, in the mix between blocks, at the end of
the motion and across the border of the loop.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack, describe_motion_track
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.codec.skeleton_description import SkeletonDescription, snap_to_grid
from bunraku.motion.skeleton import CHANNEL_COUNT, standard_figure
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore
from bunraku.playout.track_set import TrackSet
from bunraku.wire.messages import Data, Description, TimelineState
from tests.vectors.blocks import to_base64
from tests.vectors.messages import NOW_US, to_json

MOTION = "k3v9q"
LADDER = [{"kbps": 6.0, "mean": 5.0, "max": 20.0}]
STEP = 112
PLACES = ([0.5, -1.25, 0.75], [-1.0, 0.5, -2.0])


def _track(frames: int, reference: IntArray) -> MotionTrack:
    skeleton = SkeletonDescription(snap_to_grid(standard_figure(), 2), 2, reference.astype(np.float64), 2)
    return MotionTrack(24.0, frames, 8, 5, skeleton)


def _coefficients(random: np.random.Generator, frames: int) -> IntArray:
    """Smooth movement: magnitudes that fall with the frequency."""
    falloff = np.array([24.0, 12.0, 6.0, 2.0])[: min(frames, 4)]
    q: IntArray = np.round(random.normal(0.0, 1.0, (CHANNEL_COUNT, 3, len(falloff))) * falloff).astype(np.int64)
    return q


def _blocks(track: MotionTrack, random: np.random.Generator) -> list[bytes]:
    prior = load_shipped_prior()
    blocks = []
    for index in range(track.block_count):
        frames = track.frames_in(index)
        header = BlockHeader(frames, STEP, 3 * index - 2)
        q = _coefficients(random, frames)
        blocks.append(coefficients.encode_coefficients(prior, header, q, track.block_frames, track.fps))
    return blocks


def _poses(tracks: TrackSet, state: TimelineState, clock: int) -> dict[str, Any]:
    position = timeline.position_at(state, clock)
    performers = []
    for store, placement in zip(tracks.performers, tracks.placements, strict=True):
        assert store is not None
        pose = store.pose_at(position, state.loop, state.duration)
        assert pose is not None
        root, rotations = placement.apply(*pose)
        performers.append({"root": root.tolist(), "rotations": rotations.ravel().tolist()})
    return {"clock": clock, "position": position, "performers": performers}


def make_vectors() -> dict[str, Any]:
    """Return the messages of a stream and the poses that a viewer shows."""
    random = np.random.default_rng(23)
    motion_tracks = [_track(frames, random.integers(-2, 3, (18, 3))) for frames in (20, 14)]
    entries = [
        {**describe_motion_track(track, LADDER), "front": 0.25, "place": place}
        for track, place in zip(motion_tracks, PLACES, strict=True)
    ]
    description = Description(MOTION, entries)
    tracks = TrackSet(description.tracks)
    messages = []
    for number, track in enumerate(motion_tracks):
        store = tracks.store(number)
        assert isinstance(store, MotionBlockStore)
        for index, block in enumerate(_blocks(track, random)):
            store.put(index, 0, decode_motion_block(track, block))
            messages.append(Data(number, 0, index, block).pack())
    duration = motion_tracks[0].duration_us
    frame = 1e6 / 24.0
    # within a block, at a block's last frame, in the mix, at a first frame, past the end of the second performer
    frames = (0.0, 2.3, 4.0, 4.5, 4.9, 5.0, 12.25, 13.0, 13.4, 16.0, 19.0, 19.5, 19.99)
    states = [timeline.start(MOTION, duration, NOW_US, position=0, playing=True, loop=loop) for loop in (False, True)]
    return {
        "description": to_base64(description.pack()),
        "tracks": to_json(entries),
        "data": [to_base64(message) for message in messages],
        "shows": [
            {
                "timeline": to_base64(state.pack()),
                "poses": [
                    _poses(tracks, state, NOW_US + round(number * frame))
                    for number in (*frames, 20.0, *((20.5, 21.0, 44.6) if state.loop else (25.0,)))
                ],
            }
            for state in states
        ],
    }
