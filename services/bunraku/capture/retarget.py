"""Retargeting: captured frames to poses of the calibrated figure, each frame by itself.

The rules of the calibration are applied to one frame in plain floats, for which an array library would cost many times
the arithmetic. All is computed in the sender's axes and unit: only the root's position and orientation depend on them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.capture.calibration import Calibration
from bunraku.capture.frame import CapturedFrame
from bunraku.capture.source_pose import SourcePose
from bunraku.marionette.solver.vector import (
    Quaternion,
    Vector,
    add,
    conjugate,
    length,
    multiply,
    normalise,
    rotate,
    rotation_between,
    scale,
    subtract,
)
from bunraku.motion import rotation
from bunraku.motion.joint_rule import MIN_AIM_DISTANCE_M, JointRule
from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, PARENTS


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of the figure: `root` (3,) in metres, `rotations` (18, 4) as in `Motion`, and weights of blendshapes."""

    root: Array
    rotations: Array
    blendshapes: dict[str, float]


@dataclass(frozen=True, slots=True)
class _PointRule:
    """`NearestPoints` for one frame: sums over the points of weight times local position, by target."""

    targets: tuple[int, ...]
    weighted_positions: Array


@dataclass(frozen=True, slots=True)
class _FrameRule:
    """`JointRule` for one frame, with indices into the tracked joints; -1 is none."""

    offset: Vector
    parent: int
    source: int
    rest: Quaternion
    copied: int
    nearest: _PointRule | None
    aim_offset: Vector | None
    aim_start: int
    aim_target: int


class Retargeter:
    """Conversion of frames by one calibration. It keeps the last rotation of joints that frames lack."""

    def __init__(self, calibration: Calibration) -> None:
        fit, rest = calibration.fit.fit, calibration.fit.rest
        self.figure = calibration.figure
        used = sorted(
            {
                ancestor
                for joint in _list_sources(fit.rules) | {fit.joints[0]}
                for ancestor in ancestor_chain(fit.source.parents, joint)
            }
        )
        index = {joint: number for number, joint in enumerate(used)}
        index[-1] = -1
        self._pose = SourcePose(
            calibration.skeleton,
            [calibration.joints[joint] for joint in used],
            [calibration.offsets[joint] for joint in used],
            [calibration.turns[joint] for joint in used],
        )
        self._root = index[fit.joints[0]]
        self._scale = rest.scale
        self._moved = calibration.fit.moved
        self._to_figure = _as_quaternion(rest.motion_to_figure)
        self._rules = [
            _make_frame_rule(joint, fit.rules[joint], fit.offsets[joint] / rest.scale, fit.rest_orientations, index)
            for joint in range(JOINT_COUNT)
        ]

    def retarget(self, frame: CapturedFrame) -> Pose:
        """Return the pose of `frame`."""
        self._pose.update(frame)
        places, turns = self._pose.positions, self._pose.rotations
        positions: list[Vector] = []
        orientations: list[Quaternion] = []
        local: list[Quaternion] = []
        for rule in self._rules:
            parent = rule.parent
            if parent < 0:
                position = places[self._root]
            else:
                position = add(positions[parent], rotate(orientations[parent], rule.offset))
            if rule.nearest is not None:
                orientation = _solve_nearest(rule.nearest, position, places)
            elif rule.source >= 0:
                orientation = multiply(turns[rule.source], rule.rest)
            else:
                orientation = orientations[rule.copied]
            if rule.aim_offset is not None:
                start = position if rule.aim_start < 0 else places[rule.aim_start]
                bone = rotate(orientation, rule.aim_offset)
                orientation = self._aim(orientation, bone, subtract(places[rule.aim_target], start))
            positions.append(position)
            orientations.append(orientation)
            above = conjugate(orientations[parent]) if parent >= 0 else self._to_figure
            local.append(multiply(above, orientation))
        x, y, z = scale(rotate(self._to_figure, positions[0]), self._scale)
        return Pose(np.array((x, y, z)) + self._moved, np.array(local), frame.blendshapes)

    def _aim(self, orientation: Quaternion, bone: Vector, there: Vector) -> Quaternion:
        """Return `orientation` with the smallest rotation that brings the direction of `bone` to that of `there`."""
        size, distance = length(bone), length(there)
        if distance * self._scale < MIN_AIM_DISTANCE_M or size == 0.0:
            return orientation
        turn = rotation_between(scale(bone, 1.0 / size), scale(there, 1.0 / distance))
        return normalise(multiply(turn, orientation))


def _solve_nearest(rule: _PointRule, position: Vector, places: list[Vector]) -> Quaternion:
    """Return the rotation that brings the points nearest to their targets (Horn 1987, 4.A).

    It is the eigenvector of the largest eigenvalue of a symmetric matrix: the rotation that Kabsch's method finds, in a
    tenth of the time for one frame.
    """
    targets = np.array([subtract(places[target], position) for target in rule.targets])
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (rule.weighted_positions @ targets).tolist()
    matrix = np.array(
        [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ]
    )
    return _as_quaternion(np.linalg.eigh(matrix)[1][:, 3])


def _list_sources(rules: dict[int, JointRule]) -> set[int]:
    """Return the source joints that rules need."""
    found: set[int] = set()
    for rule in rules.values():
        if rule.source is not None:
            found.add(rule.source)
        if rule.nearest is not None:
            found.update(rule.nearest.targets)
        if rule.aim is not None:
            found.add(rule.aim.target)
            if rule.aim.start is not None:
                found.add(rule.aim.start)
    return found


def _make_frame_rule(
    joint: int, rule: JointRule, offset: Array, rest_orientations: Array, index: dict[int, int]
) -> _FrameRule:
    """Return a rule for one frame; `offset` (3,) is in the sender's unit, `index` that of the tracked joints.

    The fit rotates joints from rest, in the figure's axes: the sender's orientation times the inverse of the one at
    rest, `rest_orientations` (J, 4).
    """
    at_rest = rotation.IDENTITY
    if rule.source is not None:
        at_rest = rotation.multiply(rotation.conjugate(rest_orientations[rule.source]), rule.rest)
    nearest = None
    if rule.nearest is not None:
        weighted = (rule.nearest.weights[:, None] * rule.nearest.local_positions).T
        nearest = _PointRule(tuple(index[target] for target in rule.nearest.targets), weighted)
    return _FrameRule(
        offset=_as_vector(offset),
        parent=PARENTS[joint],
        source=index[-1 if rule.source is None else rule.source],
        rest=_as_quaternion(at_rest),
        copied=-1 if rule.copied is None else rule.copied,
        nearest=nearest,
        aim_offset=None if rule.aim is None else _as_vector(rule.aim.offset),
        aim_start=index[-1 if rule.aim is None or rule.aim.start is None else rule.aim.start],
        aim_target=index[-1 if rule.aim is None else rule.aim.target],
    )


def _as_vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def _as_quaternion(values: Array) -> Quaternion:
    w, x, y, z = values.tolist()
    return (w, x, y, z)
