"""Hinges of the robot: axes, ranges, torque limits and servo gains.

Each joint of the figure is up to three hinges. Their rotation in the frame of the parent is F Rx(a) Rz(b) Ry(c) F^-1:
x flexes, z leads sideways, y twists about the limb. F turns the first two axes about y; it is the identity but for
shoulders, whose axis x points 35 degrees backwards, so that the hinges are singular (b = 90 degrees) where an arm does
not reach, and not in the T-pose. Frame of the figure: x left, y up, z forwards. Ranges are those of adults in the
clinical literature, rounded; the right side is the mirror image of the left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

SHOULDER_YAW = np.radians(35.0)
"""Angle by which a shoulder's first axis points backwards, radians."""


@dataclass(frozen=True, slots=True)
class Hinge:
    """One motor: `axis` (0 x, 1 z, 2 y) of a joint, range in radians, torque limit in N m, stiffness in N m/rad."""

    joint: int
    axis: int
    lower: float
    upper: float
    torque: float
    stiffness: float

    @property
    def damping(self) -> float:
        """Damping of the servo, N m s/rad."""
        return self.stiffness * 0.1


# joint: for x, z and y the range in degrees, torque limit in N m, stiffness in N m/rad; None without a hinge
_CENTRE: dict[str, tuple[tuple[float, float, float, float] | None, ...]] = {
    "vl5": ((-30, 75, 200, 900), (-35, 35, 150, 900), (-45, 45, 100, 700)),
    "skullbase": ((-60, 60, 30, 90), (-45, 45, 25, 90), (-80, 80, 20, 60)),
}
_LEFT: dict[str, tuple[tuple[float, float, float, float] | None, ...]] = {
    "hip": ((-125, 30, 190, 700), (-30, 60, 150, 700), (-50, 50, 80, 300)),
    "knee": ((-5, 145, 200, 500), None, None),
    "ankle": ((-35, 55, 140, 300), (-30, 30, 60, 150), None),
    "shoulder": ((-200, 70, 80, 250), (-60, 95, 80, 250), (-110, 110, 40, 100)),
    "elbow": ((-150, 10, 60, 150), None, (-95, 95, 20, 40)),
    "wrist": ((-75, 75, 12, 20), (-35, 35, 10, 20), None),
}


def _make_hinges() -> tuple[Hinge, ...]:
    sides = [(name, row, 1.0) for name, row in _CENTRE.items()]
    for sign, side in ((1.0, "l_"), (-1.0, "r_")):
        sides += [(side + name, row, sign) for name, row in _LEFT.items()]
    found = []
    for name, row, sign in sides:
        for axis, values in enumerate(row):
            if values is not None:
                lower, upper, torque, stiffness = values
                if axis > 0 and sign < 0:
                    lower, upper = -upper, -lower
                limits = float(np.radians(lower)), float(np.radians(upper))
                found.append(Hinge(JOINT_INDEX[name], axis, *limits, torque, stiffness))
    return tuple(found)


HINGES = _make_hinges()
HINGE_COUNT = len(HINGES)
LOWER = np.array([hinge.lower for hinge in HINGES])
UPPER = np.array([hinge.upper for hinge in HINGES])
TORQUE_LIMITS = np.array([hinge.torque for hinge in HINGES])
STIFFNESS = np.array([hinge.stiffness for hinge in HINGES])
LEG_JOINTS = tuple(JOINT_INDEX[side + name] for side in ("l_", "r_") for name in ("hip", "knee", "ankle"))
DAMPING = np.array([hinge.damping for hinge in HINGES])
IS_LEG = np.array([hinge.joint in LEG_JOINTS for hinge in HINGES])

FRAME_YAW: dict[int, float] = {JOINT_INDEX["l_shoulder"]: SHOULDER_YAW, JOINT_INDEX["r_shoulder"]: -SHOULDER_YAW}
"""Turn about y of the first two axes of a joint, radians; 0 for joints that are not listed."""
COORDINATES = (0, 2, 1)
"""Coordinate axis of the hinges' `axis`."""


def hinge_direction(hinge: Hinge) -> Array:
    """Return the axis (3,) of a hinge in the frame of its body."""
    turn = rotation.from_coordinate_axis(1, np.array(FRAME_YAW.get(hinge.joint, 0.0)))
    return rotation.rotate(turn, np.eye(3)[COORDINATES[hinge.axis]])
