"""H-Anim LOA-1 figure: a root and 17 joints, as the paper's channels name them (paper 2, 3).

Frame: right-handed, metres, y up, z the direction the figure faces, x to its left. At rest every local rotation is the
identity and the figure stands in H-Anim's I-pose, arms down. World positions: P[k] = P[parent] + R[parent] offset[k].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

ROOT = "humanoid_root"
JOINTS: tuple[str, ...] = (
    ROOT,
    "sacroiliac",
    "l_hip",
    "l_knee",
    "l_ankle",
    "l_midtarsal",
    "r_hip",
    "r_knee",
    "r_ankle",
    "r_midtarsal",
    "vl5",
    "skullbase",
    "l_shoulder",
    "l_elbow",
    "l_wrist",
    "r_shoulder",
    "r_elbow",
    "r_wrist",
)
"""Channel order: index 0 is the root (channels 1 and 2), index k > 0 is channel k + 2."""

PARENTS: tuple[int, ...] = (-1, 0, 1, 2, 3, 4, 1, 6, 7, 8, 0, 10, 10, 12, 13, 10, 15, 16)
JOINT_INDEX: dict[str, int] = {name: index for index, name in enumerate(JOINTS)}
JOINT_COUNT = len(JOINTS)
CHANNEL_COUNT = 19
TIP_JOINTS: tuple[int, ...] = (
    JOINT_INDEX["skullbase"],
    JOINT_INDEX["l_wrist"],
    JOINT_INDEX["r_wrist"],
    JOINT_INDEX["l_midtarsal"],
    JOINT_INDEX["r_midtarsal"],
)
"""Joints with a tip beyond them: crown, finger tips, toe tips."""


@dataclass(frozen=True, slots=True)
class Figure:
    """Limb lengths of one performer, in metres in the rest pose.

    `offsets` (18, 3) are each joint's position from its parent (row 0: the root's rest position), `tips` (18, 3) the
    vector from a joint of `TIP_JOINTS` to its tip (zero elsewhere).
    """

    offsets: Array
    tips: Array

    def __post_init__(self) -> None:
        if self.offsets.shape != (JOINT_COUNT, 3) or self.tips.shape != (JOINT_COUNT, 3):
            raise ValueError(f"a figure has offsets and tips of ({JOINT_COUNT}, 3), metres")


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of one figure, `n` frames at a constant rate.

    `root` (n, 3) is the root's position in metres; `rotations` (n, 18, 4) the unit quaternions of the joints in the
    frame of their parent (row 0: the root's orientation in the world); `fps` frames per second.
    """

    figure: Figure
    fps: float
    root: Array
    rotations: Array

    def __post_init__(self) -> None:
        n = len(self.root)
        if n < 1 or self.root.shape != (n, 3) or self.rotations.shape != (n, JOINT_COUNT, 4):
            raise ValueError(f"a motion has root (n, 3) and rotations (n, {JOINT_COUNT}, 4), n >= 1")
        if not self.fps > 0:
            raise ValueError("a motion has a frame rate above zero")

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.root)

    @property
    def duration(self) -> float:
        """Duration in seconds: frames / fps, so that a loop has no gap."""
        return len(self.root) / self.fps


def standard_figure() -> Figure:
    """Return the figure of the H-Anim specification's LOA-1 example, 1.75 m tall, with hand and toe tips."""
    left = {
        "l_hip": (0.0961, 0.9124, -0.0001),
        "l_knee": (0.1040, 0.4867, 0.0308),
        "l_ankle": (0.1101, 0.0656, -0.0736),
        "l_midtarsal": (0.1086, 0.0001, 0.0368),
        "l_shoulder": (0.2029, 1.4376, -0.0387),
        "l_elbow": (0.2014, 1.1357, -0.0682),
        "l_wrist": (0.1984, 0.8663, -0.0583),
    }
    centres = {
        ROOT: (0.0, 0.8240, 0.0277),
        "sacroiliac": (0.0, 0.9149, 0.0016),
        "vl5": (0.0028, 1.0568, -0.0776),
        "skullbase": (0.0044, 1.6209, 0.0236),
        **left,
        **{"r" + name[1:]: (-x, y, z) for name, (x, y, z) in left.items()},
    }
    position = np.array([centres[name] for name in JOINTS])
    offsets = position.copy()
    offsets[1:] -= position[list(PARENTS[1:])]
    tips = np.zeros((JOINT_COUNT, 3))
    tips[JOINT_INDEX["skullbase"]] = np.array([0.0050, 1.7504, 0.0055]) - position[JOINT_INDEX["skullbase"]]
    tips[JOINT_INDEX["l_wrist"]] = np.array([0.2056, 0.6743, -0.0482]) - position[JOINT_INDEX["l_wrist"]]
    tips[JOINT_INDEX["r_wrist"]] = tips[JOINT_INDEX["l_wrist"]] * [-1.0, 1.0, 1.0]
    tips[JOINT_INDEX["l_midtarsal"]] = tips[JOINT_INDEX["r_midtarsal"]] = (0.0, 0.0, 0.07)
    return Figure(offsets, tips)


def world_transforms(figure: Figure, root: Array, rotations: Array) -> tuple[Array, Array]:
    """Return world positions (..., 18, 3) in metres and orientations (..., 18, 4) of all joints.

    `root` (..., 3) and `rotations` (..., 18, 4) are one pose or many, as in `Motion`.
    """
    position = np.empty((*root.shape[:-1], JOINT_COUNT, 3))
    orientation = np.empty((*root.shape[:-1], JOINT_COUNT, 4))
    position[..., 0, :] = root
    orientation[..., 0, :] = rotations[..., 0, :]
    for k in range(1, JOINT_COUNT):
        p = PARENTS[k]
        position[..., k, :] = position[..., p, :] + rotation.rotate(orientation[..., p, :], figure.offsets[k])
        orientation[..., k, :] = rotation.multiply(orientation[..., p, :], rotations[..., k, :])
    return position, orientation


def joint_and_tip_positions(figure: Figure, root: Array, rotations: Array) -> Array:
    """Return world positions (..., 23, 3) in metres of the 18 joints and the 5 tips.

    The codec's error is measured at these points.
    """
    position, orientation = world_transforms(figure, root, rotations)
    tip = [position[..., k, :] + rotation.rotate(orientation[..., k, :], figure.tips[k]) for k in TIP_JOINTS]
    return np.concatenate([position, np.stack(tip, axis=-2)], axis=-2)


def to_channels(motion: Motion) -> list[Array]:
    """Return the paper's 19 channels: root position (n, 3) in metres, then 18 joints as axis and angle (n, 4)."""
    turned = rotation.to_axis_angle(motion.rotations)
    return [motion.root, *(turned[:, k] for k in range(JOINT_COUNT))]


def mean_facing(motion: Motion) -> float:
    """Return the direction the motion faces on average: radians about y from z towards x; 0 if there is no main
    direction.

    It is the mean of the pelvis's forward direction on the floor; a motion that turns around has a short mean.
    """
    forward = rotation.rotate(motion.rotations[:, 0], np.array([0.0, 0.0, 1.0])).mean(axis=0)
    return float(np.arctan2(forward[0], forward[2])) if np.hypot(forward[0], forward[2]) > 0.5 else 0.0
