"""Motion track: what the blocks of a motion share, sent once in the Description (proto/messages.md, 3.2)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bunraku.codec.channel_weights import channel_weights
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.skeleton_description import FINEST_GRID_M, MAX_GRID, SkeletonDescription, snap_to_grid
from bunraku.codec.timing import Timing, parse_timing, plan_timing
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_INDEX, Figure, Motion

MOTION_CODEC = "bunraku.motion/2"
HEADING_COUNT = 64
"""Headings of a block's root in a full turn about y."""
BASE_STEP_M = 2.0**-16
"""Quantiser step of index 0 for a block of 30 frames, metres. It doubles every 16 indices."""
_MOVING_REFERENCE_BITS = 2
"""Fractional bits of references in radians, of a motion that moves."""
_STILL_REFERENCE_BITS = 14
"""Fractional bits of references in radians, of a motion whose joints stand still."""

_GRID_TO_MEAN_ERROR_RATIO = 0.4e-3
"""Grid of a figure, in metres, per mm of mean error. A finer grid costs more bytes than it gains."""
_LEFT_HIP, _RIGHT_HIP = JOINT_INDEX["l_hip"], JOINT_INDEX["r_hip"]


@dataclass(frozen=True, slots=True)
class MotionTrack(Timing):
    """Timing and skeleton of a motion, and the weights (19, 3, 3) of its channels with their inverses."""

    skeleton: SkeletonDescription
    weights: Array = field(init=False, repr=False)
    inverse_weights: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", channel_weights(self.figure, self.skeleton.reference_rotations()))
        object.__setattr__(self, "inverse_weights", np.ascontiguousarray(np.linalg.inv(self.weights)))

    @property
    def figure(self) -> Figure:
        """Figure of the skeleton, as it is decoded."""
        return self.skeleton.figure

    @property
    def is_still(self) -> bool:
        """True if the joints stand still, so that the references are their pose."""
        return self.skeleton.reference_bits == _STILL_REFERENCE_BITS

    def reference_rotations(self, heading: int = 0) -> Array:
        """Return the quaternions (18, 4) that the rotations of a block with this heading are relative to."""
        rotations = self.skeleton.reference_rotations()
        rotations[0] = rotation.multiply(_rotation_about_y(heading * 2 * np.pi / HEADING_COUNT), rotations[0])
        return rotations

    def nearest_heading(self, root: Array) -> int:
        """Return the heading (-32..31) that brings the root's reference closest to a rotation (4,)."""
        w, _, y, _ = rotation.multiply(root, rotation.conjugate(self.skeleton.reference_rotations()[0]))
        heading = round(float(np.arctan2(y, w)) * HEADING_COUNT / np.pi)
        return (heading + HEADING_COUNT // 2) % HEADING_COUNT - HEADING_COUNT // 2


def step_size(index: int, frames: int) -> float:
    """Return the quantiser step at a step index for a block of `frames` frames, metres."""
    return float(BASE_STEP_M * 2.0 ** (index / 16) * np.sqrt(frames / 30.0))


def _rotation_about_y(angle: Array | float) -> Array:
    return rotation.from_coordinate_axis(1, np.asarray(angle, dtype=np.float64))


def plan_motion_track(
    motion: Motion, block_seconds: float = 1.0, first_seconds: float | None = None, mean_error_mm: float = 0.1
) -> MotionTrack:
    """Return the track for encoding `motion`.

    Args:
        motion: The motion.
        block_seconds: Approximate length of the blocks, which are even.
        first_seconds: Length of the first block, if it differs.
        mean_error_mm: Mean error of the best level, which decides the grid of the figure.
    """
    grid = min(max(int(np.log2(mean_error_mm * _GRID_TO_MEAN_ERROR_RATIO / FINEST_GRID_M)), 0), MAX_GRID)
    figure = snap_to_grid(motion.figure, grid)
    # turn the root so that the left hip always points along x: the headings of blocks turn it back
    left = rotation.rotate(motion.rotations[:, 0], figure.offsets[_LEFT_HIP] - figure.offsets[_RIGHT_HIP])
    joints = motion.rotations.copy()
    joints[:, 0] = rotation.multiply(_rotation_about_y(np.arctan2(left[:, 2], left[:, 0])), joints[:, 0])
    # mean of the quaternions on one hemisphere
    aligned = joints * np.sign(np.sum(joints * joints[:1], axis=-1, keepdims=True) + 1e-12)
    typical = rotation.to_rotation_vector(rotation.normalise(aligned.mean(axis=0)))
    is_still = np.allclose(motion.rotations, motion.rotations[:1], atol=2.0**-_STILL_REFERENCE_BITS)
    bits = _STILL_REFERENCE_BITS if is_still else _MOVING_REFERENCE_BITS
    skeleton = SkeletonDescription(figure, grid, np.round(typical * 2.0**bits), bits)
    timing = plan_timing(motion.fps, motion.frame_count, block_seconds, first_seconds)
    return MotionTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, skeleton)


def describe_motion_track(track: MotionTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for a motion (proto/messages.md, 3.2)."""
    return {
        "type": "motion",
        "codec": MOTION_CODEC,
        "channels": CHANNEL_COUNT,
        **track.describe_timing(),
        "rates": rates,
        "dancer": track.skeleton.pack(),
    }


def parse_motion_track(description: dict[str, Any]) -> MotionTrack:
    """Return the track of `describe_motion_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    if description.get("codec") != MOTION_CODEC:
        raise DamagedBlock(f"Unsupported motion codec {description.get('codec')!r}, expected {MOTION_CODEC!r}.")
    timing = parse_timing(description, "motion")
    skeleton = description.get("dancer")
    if not isinstance(skeleton, bytes):
        raise DamagedBlock("Invalid motion track: dancer (the skeleton description) must be bytes.")
    return MotionTrack(
        timing.fps, timing.frames, timing.block_frames, timing.first_frames, SkeletonDescription.unpack(skeleton)
    )
