"""Figures of a run of the robot: broken limits, falls, tracking errors, and speed of the simulation."""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure, world_transforms
from examples.robot.joints import LOWER, TORQUE_LIMITS, UPPER

JOINT_TOLERANCE = np.radians(0.5)
"""Angle beyond a hinge's range from which it counts as broken, radians: MuJoCo's limits are soft."""
TORQUE_TOLERANCE = 1e-6
"""Relative excess of a torque that is rounding."""
BONES = (
    (JOINT_INDEX["vl5"], JOINT_INDEX["skullbase"]),
    *(
        (JOINT_INDEX[side + start], JOINT_INDEX[side + end])
        for side in ("l_", "r_")
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
    ),
)
"""Bones whose directions are compared, by their joints."""
MAX_SAMPLES = 100_000
"""Frames whose errors are kept; later ones are not counted."""


class Measurement:
    """Counts and errors of one run."""

    def __init__(self) -> None:
        self.steps = 0
        self.joint_limits_broken = 0
        self.torque_limits_broken = 0
        self.unstable = 0
        self.falls = 0
        self.largest_excess = 0.0
        """Largest angle beyond a joint's range, radians."""
        self.largest_torque_share = 0.0
        self.saturated = 0
        """Motor steps at the limit of the torque."""
        self.simulated_s = 0.0
        self.computed_s = 0.0
        self._servo: list[Array] = []
        self._bones: list[Array] = []
        self._roots: list[float] = []

    @property
    def limits_broken(self) -> int:
        """Number of steps and hinges that broke a limit, and of resets of an unstable simulation."""
        return self.joint_limits_broken + self.torque_limits_broken + self.unstable

    def add_step(self, angles: Array, torques: Array) -> None:
        """Count the broken limits of one physics step: hinge angles (H,) in radians, torques (H,) in N m."""
        self.steps += 1
        excess = np.maximum(angles - UPPER, LOWER - angles)
        share = np.abs(torques) / TORQUE_LIMITS
        # written so that a value that is not a number counts as broken
        self.joint_limits_broken += int((~(excess <= JOINT_TOLERANCE)).sum())
        self.torque_limits_broken += int((~(share <= 1.0 + TORQUE_TOLERANCE)).sum())
        self.saturated += int((share >= 0.999).sum())
        self.largest_excess = max(self.largest_excess, float(excess.max()))
        self.largest_torque_share = max(self.largest_torque_share, float(share.max()))

    def add_frame(self, servo_error: Array, bone_error: Array, root_error: float) -> None:
        """Store the errors of one frame: of hinges against targets, of bones against the pose, and of the root."""
        if len(self._roots) < MAX_SAMPLES:
            self._servo.append(np.abs(servo_error))
            self._bones.append(bone_error)
            self._roots.append(root_error)

    def summary(self) -> dict[str, Any]:
        """Return the figures: angles in degrees, lengths in metres."""
        figures: dict[str, Any] = {
            "seconds": round(self.simulated_s, 2),
            "steps": self.steps,
            "joint_limits_broken": self.joint_limits_broken,
            "torque_limits_broken": self.torque_limits_broken,
            "unstable": self.unstable,
            "falls": self.falls,
            "joint_excess_deg_max": round(float(np.degrees(self.largest_excess)), 3),
            "torque_share_max": round(self.largest_torque_share, 6),
            "torque_saturated_share": round(self.saturated / max(self.steps * len(TORQUE_LIMITS), 1), 5),
            "real_time_factor": round(self.simulated_s / self.computed_s, 2) if self.computed_s else None,
        }
        for name, samples in (("servo_error", self._servo), ("pose_error", self._bones)):
            for percent in (50, 95):
                value = float(np.degrees(np.percentile(np.array(samples), percent))) if samples else None
                figures[f"{name}_deg_p{percent}"] = None if value is None else round(value, 2)
        figures["root_error_m_p95"] = round(float(np.percentile(self._roots, 95)), 3) if self._roots else None
        return figures


def bone_errors(figure: Figure, wanted: Array, reached: Array) -> Array:
    """Return the angles (B,) between the bones of two poses' rotations (18, 4) in radians, seen from the pelvis."""
    directions = []
    for rotations in (wanted, reached):
        position, orientation = world_transforms(figure, np.zeros(3), rotations)
        bones = np.array([position[end] - position[start] for start, end in BONES])
        directions.append(rotation.normalise(rotation.rotate(rotation.conjugate(orientation[1]), bones)))
    angles: Array = np.arccos(np.clip((directions[0] * directions[1]).sum(axis=1), -1.0, 1.0))
    return angles
