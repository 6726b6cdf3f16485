"""What the blocks of one motion have in common: sent once, in the Description (SPEC.md, Track `motion`)."""

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
"""Headings of a block's root in a whole turn about y."""
BASE_STEP_M = 2.0**-16
"""Quantiser step of index 0 for a block of 30 frames, metres; sixteen indices make it twice as large."""
_REFERENCE_BITS = 2, 14
"""Bits after the point of references in radians: of a motion, and of one that stands still."""

_GRID_TO_MEAN_ERROR_RATIO = 0.4e-3
"""A figure's grid is about this share, in metres, of a mean error in mm: finer costs more bytes than it mends."""
_LEFT_HIP, _RIGHT_HIP = JOINT_INDEX["l_hip"], JOINT_INDEX["r_hip"]


@dataclass(frozen=True, slots=True)
class MotionTrack(Timing):
    """Constants of a motion's blocks, beside their timing."""

    skeleton: SkeletonDescription
    weights: Array = field(init=False, repr=False)
    inverse_weights: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """`weights` (19, 3, 3) is what a channel's values are multiplied with before they are quantised (SPEC.md,
        Weights), `inverse_weights` what undoes it."""
        object.__setattr__(self, "weights", channel_weights(self.figure, self.skeleton.reference_rotations()))
        object.__setattr__(self, "inverse_weights", np.ascontiguousarray(np.linalg.inv(self.weights)))

    @property
    def figure(self) -> Figure:
        """The dancer's, as it is decoded."""
        return self.skeleton.figure

    @property
    def is_still(self) -> bool:
        """Whether the joints' references are fine enough to be their only pose."""
        return self.skeleton.reference_bits == _REFERENCE_BITS[1]

    def reference_rotations(self, heading: int = 0) -> Array:
        """What a block of this `heading` tells rotations from: quaternions (18, 4)."""
        rotations = self.skeleton.reference_rotations()
        rotations[0] = rotation.multiply(_rotation_about_y(heading * 2 * np.pi / HEADING_COUNT), rotations[0])
        return rotations

    def nearest_heading(self, root: Array) -> int:
        """The heading (-32..31) that brings the root's reference nearest to a rotation (4,)."""
        w, _, y, _ = rotation.multiply(root, rotation.conjugate(self.skeleton.reference_rotations()[0]))
        turned = round(float(np.arctan2(y, w)) * HEADING_COUNT / np.pi)
        return (turned + HEADING_COUNT // 2) % HEADING_COUNT - HEADING_COUNT // 2


def step_size(index: int, frames: int) -> float:
    """Quantiser step at step index `index` of the weighted coefficients of a block of `frames` frames, metres."""
    return float(BASE_STEP_M * 2.0 ** (index / 16) * np.sqrt(frames / 30.0))


def _rotation_about_y(angle: Array | float) -> Array:
    return rotation.from_coordinate_axis(1, np.asarray(angle, dtype=np.float64))


def plan_motion_track(
    motion: Motion, block_seconds: float = 1.0, first_seconds: float | None = None, mean_error_mm: float = 0.1
) -> MotionTrack:
    """The track of `motion` in even blocks of about `block_seconds`, the first of `first_seconds` where that is
    given, its figure on a grid that a mean error of `mean` mm asks for."""
    grid = min(max(int(np.log2(mean_error_mm * _GRID_TO_MEAN_ERROR_RATIO / FINEST_GRID_M)), 0), MAX_GRID)
    figure = snap_to_grid(motion.figure, grid)
    # the root as if the left hip were always along x
    left = rotation.rotate(motion.rotations[:, 0], figure.offsets[_LEFT_HIP] - figure.offsets[_RIGHT_HIP])
    joints = motion.rotations.copy()
    joints[:, 0] = rotation.multiply(_rotation_about_y(np.arctan2(left[:, 2], left[:, 0])), joints[:, 0])
    # the mean direction of the quaternions, taken on one hemisphere
    aligned = joints * np.sign(np.sum(joints * joints[:1], axis=-1, keepdims=True) + 1e-12)
    typical = rotation.to_rotation_vector(rotation.normalise(aligned.mean(axis=0)))
    bits = _REFERENCE_BITS[np.allclose(motion.rotations, motion.rotations[:1], atol=2.0 ** -_REFERENCE_BITS[1])]
    dancer = SkeletonDescription(figure, grid, np.round(typical * 2.0**bits), bits)
    timing = plan_timing(motion.fps, motion.frame_count, block_seconds, first_seconds)
    return MotionTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, dancer)


def describe_motion_track(track: MotionTrack, ladder: list[dict[str, float]]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this motion (SPEC.md, Track `motion`)."""
    return {
        "type": "motion",
        "codec": MOTION_CODEC,
        "channels": CHANNEL_COUNT,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "rates": ladder,
        "dancer": track.skeleton.pack(),
    }


def parse_motion_track(description: dict[str, Any]) -> MotionTrack:
    """The track of `describe_track`; raises `DamagedBlock` where it is not one, or of another codec."""
    if description.get("codec") != MOTION_CODEC:
        raise DamagedBlock(f"the motion is in {description.get('codec')!r}; this reads {MOTION_CODEC!r}")
    timing = parse_timing(description, "motion")
    dancer = description.get("dancer")
    if not isinstance(dancer, bytes):
        raise DamagedBlock("a motion's track has a dancer, bytes")
    return MotionTrack(
        timing.fps, timing.frames, timing.block_frames, timing.first_frames, SkeletonDescription.unpack(dancer)
    )
