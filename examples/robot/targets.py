"""Joint targets of the robot from a pose of the figure, and the pose of its joint angles. Both are pure."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX
from examples.robot.joints import FRAME_YAW, HINGE_COUNT, HINGES, LOWER, UPPER

TARGET_MARGIN = np.radians(6.0)
"""Distance that targets keep from the ends of a hinge's range, radians."""
MAX_SPEED = 8.0
"""Speed limit of targets, rad/s."""
STRAIGHT_WEIGHT = 0.15
"""Weight of the last bending plane against the present one, which is undefined for a straight limb."""
_PREFERENCE = 1e-9
"""Weight of the distance from the last angles, which decides when hinges reach an orientation in two ways."""

_LIMBS = tuple(
    (JOINT_INDEX[side + upper], JOINT_INDEX[side + lower], sign)
    for side in ("l_", "r_")
    for upper, lower, sign in (("shoulder", "elbow", 1.0), ("hip", "knee", -1.0))
)
"""Upper and lower joint of each limb, and the sign of z to which the lower bone bends."""
LOWER_TARGETS = np.minimum(LOWER + TARGET_MARGIN, 0.0)
UPPER_TARGETS = np.maximum(UPPER - TARGET_MARGIN, 0.0)
"""Range of the targets; 0, the rest pose, belongs to it."""
_JOINTS = np.array([hinge.joint for hinge in HINGES])
_AXES = np.array([hinge.axis for hinge in HINGES])
_LOW, _HIGH = np.zeros((JOINT_COUNT, 3)), np.zeros((JOINT_COUNT, 3))
_LOW[_JOINTS, _AXES], _HIGH[_JOINTS, _AXES] = LOWER_TARGETS, UPPER_TARGETS
_CENTRES = 0.5 * (_LOW + _HIGH)
_FRAMES = rotation.from_coordinate_axis(1, np.array([FRAME_YAW.get(joint, 0.0) for joint in range(JOINT_COUNT)]))


def compose_hinges(a: Array, b: Array, c: Array) -> Array:
    """Return the rotation Rx(a) Rz(b) Ry(c) (..., 4) of three angles (...) in radians."""
    x, z, y = (rotation.from_coordinate_axis(axis, v) for axis, v in ((0, a), (2, b), (1, c)))
    return rotation.multiply(rotation.multiply(x, z), y)


def decompose_hinges(q: Array) -> Array:
    """Return the angles a, b, c (..., 3) of `compose_hinges` in radians, b within a right angle."""
    m = rotation.to_matrix(q)
    # m = [[cb cc, -sb, cb sc], [.., ca cb, ..], [.., sa cb, ..]]
    b = np.arcsin(np.clip(-m[..., 0, 1], -1.0, 1.0))
    return np.stack([np.arctan2(m[..., 2, 1], m[..., 1, 1]), b, np.arctan2(m[..., 0, 2], m[..., 0, 0])], axis=-1)


def angles_to_rotations(angles: Array) -> Array:
    """Return the rotations (18, 4) of the figure's joints for hinge angles (H,); joints without hinges do not turn."""
    triples = np.zeros((JOINT_COUNT, 3))
    triples[_JOINTS, _AXES] = angles
    return _turn_frames(compose_hinges(triples[:, 0], triples[:, 1], triples[:, 2]), _FRAMES)


def pelvis_orientation(rotations: Array) -> Array:
    """Return the orientation (4,) of the pelvis in the world of a pose with rotations (18, 4)."""
    return rotation.multiply(rotations[0], rotations[1])


class TargetFinder:
    """Finder of hinge angles for the poses of one performer; it remembers the last, and limits the speed."""

    def __init__(self) -> None:
        self._angles = np.zeros(HINGE_COUNT)
        self._planes = np.zeros(len(_LIMBS))
        self._has_pose = False

    @property
    def angles(self) -> Array:
        """Last targets (H,), radians."""
        return self._angles.copy()

    def update(self, rotations: Array, seconds: float) -> Array:
        """Return the targets (H,) in radians for a pose `rotations` (18, 4), `seconds` after the last one.

        Targets keep `TARGET_MARGIN` from the ends of the ranges, and change by at most `MAX_SPEED`; the first pose is
        not limited in speed. Rotations that are not finite keep the last targets.
        """
        if not np.isfinite(rotations).all():
            return self.angles
        wanted = self._find(rotations)
        step = MAX_SPEED * seconds if self._has_pose else np.inf
        self._angles = self._angles + np.clip(wanted - self._angles, -step, step)
        self._has_pose = True
        return self.angles

    def _find(self, rotations: Array) -> Array:
        local = np.array(rotations, dtype=np.float64)
        # the pelvis is the sacroiliac: the trunk turns against it and not against the root
        trunk = JOINT_INDEX["vl5"]
        local[trunk] = rotation.multiply(rotation.conjugate(local[1]), local[trunk])
        for nth, (upper, lower, sign) in enumerate(_LIMBS):
            self._planes[nth] = plane = _bending_plane(local[lower], sign, float(self._planes[nth]))
            twist = rotation.from_coordinate_axis(1, np.array(plane))
            local[upper] = rotation.multiply(local[upper], twist)
            local[lower] = rotation.multiply(rotation.conjugate(twist), local[lower])
        last = np.zeros((JOINT_COUNT, 3))
        last[_JOINTS, _AXES] = self._angles
        angles: Array = _fit_joints(_turn_frames(local, rotation.conjugate(_FRAMES)), last)[_JOINTS, _AXES]
        return angles


def _turn_frames(q: Array, frames: Array) -> Array:
    """Return F q F^-1 for rotations `q` and frames F (J, 4)."""
    return rotation.multiply(rotation.multiply(frames, q), rotation.conjugate(frames))


def _bending_plane(lower: Array, sign: float, last: float) -> float:
    """Return the twist of the upper bone about y with which the lower bone bends about x, radians.

    The lower joint turns by `lower` (4,). For a straight limb, the twist stays at `last`.
    """
    x, _, z = sign * rotation.rotate(lower, np.array([0.0, -1.0, 0.0]))
    return float(np.arctan2(x + STRAIGHT_WEIGHT * np.sin(last), z + STRAIGHT_WEIGHT * np.cos(last)))


def _fit_joints(q: Array, last: Array) -> Array:
    """Return the angles (J, 3) of all joints, within their ranges, whose rotations are nearest to `q` (J, 4)."""
    a, b, c = np.moveaxis(decompose_hinges(q), -1, 0)
    # the two solutions, each angle as near to the middle of its range as a whole turn allows
    angles = np.array([[a, b, c], [a + np.pi, np.pi - b, c + np.pi]]).transpose(0, 2, 1)
    angles = _CENTRES + np.remainder(angles - _CENTRES + np.pi, 2 * np.pi) - np.pi
    angles = np.clip(angles, _LOW, _HIGH)
    reached = compose_hinges(*np.moveaxis(angles, -1, 0))
    error = 1.0 - np.abs((reached * q).sum(axis=-1))
    cost = error + _PREFERENCE * np.square(angles - last).sum(axis=-1)
    best: Array = np.where((cost[0] <= cost[1])[:, None], angles[0], angles[1])
    return best
