"""What the blocks of one motion have in common: sent once, in the Description (SPEC.md, Track `motion`)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bunraku.codec.dancer import on_grid, pack_dancer, unpack_dancer
from bunraku.codec.errors import DamagedBlock
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, INDEX, JOINT_COUNT, PARENTS, TIPS, Figure, Motion

CODEC = "bunraku.motion/2"
TURN_UNIT = 0.1
"""Radians in one unit of a block's turn of the root."""
STEP_UNIT = 2.0**-16
"""Quantiser step of index 0 for a block of 30 frames, metres; sixteen indices make it twice as large."""
MOST_FPS = 100_000
"""Frames a second, at most: instants are whole microseconds."""
MOST_BLOCKS = 86_400
"""Of a motion: a day of seconds."""
MOST_US = 1 << 48
"""A motion is shorter: block times have six bytes."""
_BITS = 3, 14
"""Bits after the point of references in radians: of a motion, and of one that stands still."""

_LEVER = 0.45
_TWIST = 0.06**2
# how much finer than its lever says a channel is coded: root position and rotation, sacroiliac, wrists, head, toes
_CARE = np.ones(CHANNEL_COUNT)
_CARE[[0, 1, 2]] = 1.15, 0.88, 0.88
_CARE[[INDEX[name] + 1 for name in ("l_midtarsal", "r_midtarsal")]] = 0.87
_CARE[[INDEX[name] + 1 for name in ("skullbase", "l_wrist", "r_wrist")]] = 0.9


@dataclass(frozen=True, slots=True)
class MotionTrack:
    """Constants of a motion's blocks.

    `fps` and `frames` as in `Motion`; the first block has `first_frames` frames, every other but perhaps the last
    `block_frames`; `figure` is the dancer, on the grid of `FIGURE_UNIT`; `reference` (17, 3) whole numbers are each
    joint's typical rotation, a rotation vector in 2^-`reference_bits` radians.
    """

    fps: float
    frames: int
    block_frames: int
    first_frames: int
    figure: Figure
    reference: Array
    reference_bits: int
    weights: Array = field(init=False, repr=False)
    unweights: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """`weights` (19, 3, 3) is what a channel's values are multiplied with before they are quantised (SPEC.md,
        Weights), `unweights` what undoes it."""
        object.__setattr__(self, "weights", _weights(self.figure))
        object.__setattr__(self, "unweights", np.ascontiguousarray(np.linalg.inv(self.weights)))

    @property
    def still(self) -> bool:
        """Whether the joints' references are fine enough to be their only pose."""
        return self.reference_bits == _BITS[1]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return 1 - (-(self.frames - self.first_frames) // self.block_frames)

    @property
    def duration_us(self) -> int:
        """Length in microseconds."""
        return round(self.frames * 1e6 / self.fps)

    def first_frame(self, index: int) -> int:
        """Frame of the motion with which block `index` starts."""
        return self.first_frames + (index - 1) * self.block_frames if index > 0 else 0

    def frames_in(self, index: int) -> int:
        """Frames of block `index`."""
        if index == 0:
            return self.first_frames
        return min(self.block_frames, self.frames - self.first_frame(index))

    def start_us(self, index: int) -> int:
        """Motion time of the first frame of block `index`, microseconds: the timestamp of its Data Packet."""
        return round(self.first_frame(index) * 1e6 / self.fps)

    def block_at(self, position_us: float) -> int:
        """Index of the block that holds the instant `position_us`, kept within the motion."""
        # a start is rounded to the microsecond, and may be a little before its frame
        frame = (position_us + 1) * self.fps / 1e6
        index = int((frame - self.first_frames) // self.block_frames) + 1 if frame >= self.first_frames else 0
        return min(max(index, 0), self.blocks - 1)

    @property
    def reference_rotations(self) -> Array:
        """`reference` as quaternions (17, 4)."""
        return rotation.from_rotation_vector(self.reference * 2.0**-self.reference_bits)


def step_size(index: int, frames: int) -> float:
    """Quantiser step at step index `index` of the weighted coefficients of a block of `frames` frames, metres."""
    return float(STEP_UNIT * 2.0 ** (index / 16) * np.sqrt(frames / 30.0))


def _weights(figure: Figure) -> Array:
    points = np.ones(JOINT_COUNT)
    points[list(TIPS)] += 1
    squares = np.zeros((JOINT_COUNT, 3, 3))

    def add(joint: int, arm: Array, count: float) -> None:
        squares[joint] += count**_LEVER * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    for joint in range(JOINT_COUNT - 1, -1, -1):
        squares[joint] += _TWIST * np.eye(3)
        if joint in TIPS:
            add(joint, figure.tips[joint], 1)
        if joint > 0:
            add(PARENTS[joint], figure.offsets[joint], points[joint])
            points[PARENTS[joint]] += points[joint]
    weights = np.empty((CHANNEL_COUNT, 3, 3))
    weights[0] = points[0] ** (_LEVER / 2) * np.eye(3)
    values, vectors = np.linalg.eigh(squares)
    # the symmetric square root
    weights[1:] = (vectors * np.sqrt(values)[:, None]) @ vectors.transpose(0, 2, 1)
    weighted: Array = weights * _CARE[:, None, None]
    return weighted


def plan(motion: Motion, block_seconds: float = 1.0, first_seconds: float | None = None) -> tuple[MotionTrack, Motion]:
    """The track of `motion` in even blocks of about `block_seconds`, the first of `first_seconds` where that is
    given, and the motion upon the track's figure.

    The figure goes to the track's grid (0.05 mm) before anything is encoded, so that limb lengths are exact ever after.
    """
    figure = on_grid(motion.figure)
    joints = motion.rotations[:, 1:]
    # the mean direction of the quaternions, taken on one hemisphere
    aligned = joints * np.sign(np.sum(joints * joints[:1], axis=-1, keepdims=True) + 1e-12)
    mean = rotation.to_rotation_vector(rotation.normalise(aligned.mean(axis=0)))
    still = np.allclose(motion.rotations, motion.rotations[:1], atol=2.0 ** -_BITS[1])
    reference_bits = _BITS[still]
    reference = np.round(mean * 2.0**reference_bits)
    frames = motion.frames
    first = 0 if first_seconds is None else min(max(1, round(first_seconds * motion.fps)), frames, 1000)
    pieces = max(1, round((frames - first) / (block_seconds * motion.fps)))
    block_frames = min(max(1, -(-(frames - first) // pieces)), 1000)
    track = MotionTrack(
        motion.fps, frames, block_frames, first or min(block_frames, frames), figure, reference, reference_bits
    )
    return track, Motion(figure, motion.fps, motion.root, motion.rotations)


def describe_track(track: MotionTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this motion (SPEC.md, Track `motion`)."""
    return {
        "type": "motion",
        "codec": CODEC,
        "channels": CHANNEL_COUNT,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "rates": rates,
        "dancer": pack_dancer(track.figure, track.reference, track.reference_bits),
    }


def read_track(described: dict[str, Any]) -> MotionTrack:
    """The track of `describe_track`; raises `DamagedBlock` where it is not one, or of another codec."""
    if described.get("codec") != CODEC:
        raise DamagedBlock(f"the motion is in {described.get('codec')!r}; this reads {CODEC!r}")
    fps = described.get("fps")
    frames, block_frames, first_frames = (described.get(key) for key in ("frames", "block_frames", "first_frames"))
    dancer = described.get("dancer")
    if not (
        isinstance(fps, float | int)
        and isinstance(frames, int)
        and isinstance(block_frames, int)
        and isinstance(first_frames, int)
    ):
        raise DamagedBlock("a motion's track has numbers fps, frames, block_frames and first_frames")
    if not (0 < fps <= MOST_FPS and 0 < first_frames <= min(frames, 1000) and 0 < block_frames <= 1000):
        raise DamagedBlock(
            f"a motion's track has fps above zero, at most {MOST_FPS}, frames above zero and blocks of 1..1000 frames"
        )
    if frames > MOST_BLOCKS * block_frames or frames * 1e6 / fps >= MOST_US:
        raise DamagedBlock(f"a motion has at most {MOST_BLOCKS} blocks and less than 2^48 microseconds")
    if not isinstance(dancer, bytes):
        raise DamagedBlock("a motion's track has a dancer, bytes")
    return MotionTrack(float(fps), frames, block_frames, first_frames, *unpack_dancer(dancer))
