"""What the blocks of one motion have in common: sent once, in the Description (SPEC.md, Track `motion`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, PARENTS, TIPS, Figure, Motion

CODEC = "bunraku.motion/1"
FIGURE_UNIT = 1e-4
"""Metres in one unit of the figure's 16-bit offsets."""
REFERENCE_UNIT = np.pi / 127
"""Radians in one unit of an 8-bit rotation vector."""

_FIGURE_NUMBERS = 3 * (JOINT_COUNT + len(TIPS))


@dataclass(frozen=True, slots=True)
class MotionTrack:
    """Constants of a motion's blocks.

    `fps` and `frames` as in `Motion`; every block but perhaps the last has `block_frames` frames; `figure` is the
    dancer, on the grid of `FIGURE_UNIT`; `reference` (17, 3) int8 is each joint's typical rotation, a rotation vector
    in `REFERENCE_UNIT`.
    """

    fps: float
    frames: int
    block_frames: int
    figure: Figure
    reference: Array

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.frames // self.block_frames)

    @property
    def duration_us(self) -> int:
        """Length in microseconds."""
        return round(self.frames * 1e6 / self.fps)

    def frames_in(self, index: int) -> int:
        """Frames of block `index`."""
        return min(self.block_frames, self.frames - index * self.block_frames)

    def start_us(self, index: int) -> int:
        """Motion time of the first frame of block `index`, microseconds: the timestamp of its Data Packet."""
        return round(index * self.block_frames * 1e6 / self.fps)

    def block_at(self, position_us: float) -> int:
        """Index of the block that holds the instant `position_us`, kept within the motion."""
        index = int(position_us * self.fps / 1e6 / self.block_frames + 1e-6)
        return min(max(index, 0), self.blocks - 1)

    @property
    def reference_rotations(self) -> Array:
        """`reference` as quaternions (17, 4)."""
        return rotation.from_rotation_vector(self.reference * REFERENCE_UNIT)

    @property
    def levers(self) -> Array:
        """How far a turn of each channel moves the body (19,): SPEC.md, Quantiser."""
        figure = self.figure
        points = np.ones(JOINT_COUNT)
        squares = 0.06**2 + np.sum(figure.tips**2, axis=1)
        points[list(TIPS)] += 1
        for joint in range(JOINT_COUNT - 1, 0, -1):
            squares[PARENTS[joint]] += points[joint] ** 0.45 * np.sum(figure.offsets[joint] ** 2)
            points[PARENTS[joint]] += points[joint]
        return np.concatenate([[2.6], np.sqrt(squares)])

    def steps(self, index: int, frames: int) -> Array:
        """Quantiser steps (19,) of the coefficients at step index `index` in a block of `frames` frames."""
        steps: Array = 1e-4 * 2.0 ** (index / 4) * np.sqrt(frames / 30.0) / self.levers
        return steps


def plan(motion: Motion, block_seconds: float = 1.0) -> tuple[MotionTrack, Motion]:
    """The track of `motion` in blocks of about `block_seconds`, and the motion upon the track's figure.

    The figure goes to the track's grid (0.05 mm) before anything is encoded, so that limb lengths are exact ever after.
    """
    figure = Figure(
        np.round(motion.figure.offsets / FIGURE_UNIT) * FIGURE_UNIT,
        np.round(motion.figure.tips / FIGURE_UNIT) * FIGURE_UNIT,
    )
    joints = motion.rotations[:, 1:]
    # the mean direction of the quaternions, taken on one hemisphere
    aligned = joints * np.sign(np.sum(joints * joints[:1], axis=-1, keepdims=True) + 1e-12)
    mean = rotation.to_rotation_vector(rotation.normalise(aligned.mean(axis=0)))
    reference = np.clip(np.round(mean / REFERENCE_UNIT), -127, 127)
    block_frames = min(max(1, round(block_seconds * motion.fps)), 1000)
    track = MotionTrack(motion.fps, motion.frames, block_frames, figure, reference)
    return track, Motion(figure, motion.fps, motion.root, motion.rotations)


def pack_figure(figure: Figure) -> bytes:
    """138 bytes: 18 offsets and 5 tips, each 3 x i16 in `FIGURE_UNIT`; a limb may be 3.27 m long."""
    numbers = np.concatenate([figure.offsets, figure.tips[list(TIPS)]]) / FIGURE_UNIT
    return np.clip(np.round(numbers), -32767, 32767).astype("<i2").tobytes()


def unpack_figure(data: bytes) -> Figure:
    """The figure of `pack_figure`; raises `DamagedBlock`."""
    if len(data) != 2 * _FIGURE_NUMBERS:
        raise DamagedBlock(f"a figure has {2 * _FIGURE_NUMBERS} bytes, not {len(data)}")
    numbers = np.frombuffer(data, "<i2").reshape(-1, 3) * FIGURE_UNIT
    tips = np.zeros((JOINT_COUNT, 3))
    tips[list(TIPS)] = numbers[JOINT_COUNT:]
    return Figure(numbers[:JOINT_COUNT], tips)


def pack_reference(reference: Array) -> bytes:
    """51 bytes: the rotation vectors (17, 3) in `REFERENCE_UNIT` as i8."""
    return np.asarray(reference).astype("i1").tobytes()


def unpack_reference(data: bytes) -> Array:
    """The reference of `pack_reference`; raises `DamagedBlock`."""
    if len(data) != 3 * (CHANNEL_COUNT - 2):
        raise DamagedBlock(f"references have {3 * (CHANNEL_COUNT - 2)} bytes, not {len(data)}")
    return np.frombuffer(data, "i1").reshape(-1, 3).astype(np.float64)


def describe_track(track: MotionTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this motion (SPEC.md, Track `motion`)."""
    return {
        "type": "motion",
        "codec": CODEC,
        "channels": CHANNEL_COUNT,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "rates": rates,
        "figure": pack_figure(track.figure),
        "reference": pack_reference(track.reference),
    }


def read_track(described: dict[str, Any]) -> MotionTrack:
    """The track of `describe_track`; raises `DamagedBlock` where it is not one, or of another codec."""
    if described.get("codec") != CODEC:
        raise DamagedBlock(f"the motion is in {described.get('codec')!r}; this reads {CODEC!r}")
    fps, frames, block_frames = (described.get(key) for key in ("fps", "frames", "block_frames"))
    figure, reference = described.get("figure"), described.get("reference")
    if not (isinstance(fps, float | int) and isinstance(frames, int) and isinstance(block_frames, int)):
        raise DamagedBlock("a motion's track has numbers fps, frames and block_frames")
    if not (fps > 0 and frames > 0 and 0 < block_frames <= 1000):
        raise DamagedBlock("a motion's track has fps and frames above zero and blocks of 1..1000 frames")
    if not (isinstance(figure, bytes) and isinstance(reference, bytes)):
        raise DamagedBlock("a motion's track has a figure and a reference")
    return MotionTrack(float(fps), frames, block_frames, unpack_figure(figure), unpack_reference(reference))
