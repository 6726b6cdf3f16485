"""Fit of a body extension to a source that has the joints (proto/codec.md, 2.17)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.extension import (
    DRIVE_UNIT,
    LENGTH_UNIT_M,
    MAX_SPINE_JOINTS,
    REST_UNIT_RAD,
    BodyExtension,
    ExtendedPose,
    JointKind,
    extend_pose,
    find_driver,
)
from bunraku.motion.fit import FigureFit
from bunraku.motion.joint_rule import aim_at
from bunraku.motion.joint_tree import ancestor_chain, common_ancestor
from bunraku.motion.procrustes import mean_local_positions
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure

MAX_DRIVE = 127
MIN_IMPROVEMENT_MM = 1.0
"""A figure whose head and shoulders are never farther from the source's than this needs no extension."""

_HEAD = JOINT_INDEX["skullbase"]
_SHOULDERS = JOINT_INDEX["l_shoulder"], JOINT_INDEX["r_shoulder"]
_RIDGE = 1e-3
"""Weight, per frame, of the drive's distance from the usual share: it decides where the driver does not move."""
NECK_SHARE = 0.5
"""Share of the head's rotation with which a neck usually turns."""


@dataclass(frozen=True, slots=True)
class ExtensionMotion:
    """Extension of a motion: its joints, their values (n, E, 3), and the source joint that each follows."""

    extension: BodyExtension
    values: Array
    sources: tuple[int, ...]


def fit_body_extension(fit: FigureFit) -> ExtensionMotion | None:
    """Return the extension by which the figure follows the source's spine, neck and clavicles.

    Returns None if the source has none of them, or the figure's head and shoulders are in place without.
    """
    ends = [joint for joint in (_HEAD, *_SHOULDERS) if joint in fit.joints]
    apart = fit.joint_positions[:, ends] - fit.position[:, [fit.joints[joint] for joint in ends]]
    if 1000.0 * np.linalg.norm(apart, axis=-1).max() < MIN_IMPROVEMENT_MM:
        return None
    sources = _find_sources(fit)
    if not sources:
        return None
    return _ExtensionFit(fit, sources).solve()


def extended_pose(fit: FigureFit, figure: Figure, extended: ExtensionMotion) -> ExtendedPose:
    """Return the extended pose of every frame of a fit."""
    return extend_pose(figure, extended.extension, fit.joint_positions, fit.joint_orientations, extended.values)


def _find_sources(fit: FigureFit) -> list[tuple[JointKind, int]]:
    """Return the source joints that the extension's joints follow, in its order."""
    parents = fit.source.parents

    def between(ancestor: int, joint: int) -> list[int]:
        chain = ancestor_chain(parents, joint)
        return chain[1 : chain.index(ancestor)][::-1]

    shoulders = [fit.joints[joint] for joint in _SHOULDERS]
    chest = common_ancestor(parents, shoulders)
    root = fit.joints[0]
    if root not in ancestor_chain(parents, chest):
        return []
    spine = [*between(root, chest), chest] if chest != root else []
    if len(spine) > MAX_SPINE_JOINTS:
        spine = [spine[round(k)] for k in np.linspace(0, len(spine) - 1, MAX_SPINE_JOINTS)]
    sources = [(JointKind.SPINE, joint) for joint in spine]
    if _HEAD in fit.joints and chest in ancestor_chain(parents, fit.joints[_HEAD]):
        sources += [(JointKind.NECK, joint) for joint in between(chest, fit.joints[_HEAD])[:1]]
    clavicles = [between(chest, shoulder)[:1] for shoulder in shoulders]
    if all(clavicles):
        kinds = JointKind.LEFT_CLAVICLE, JointKind.RIGHT_CLAVICLE
        sources += [(kind, joint) for kind, (joint,) in zip(kinds, clavicles, strict=True)]
    return sources


class _ExtensionFit:
    """State of an extension while it is fitted: the joints placed so far, all in the figure's axes and metres."""

    def __init__(self, fit: FigureFit, sources: list[tuple[JointKind, int]]) -> None:
        self._fit = fit
        self._sources = sources
        self._start, self._frame = fit.joint_positions[:, 0], fit.joint_orientations[:, 0]
        self._chest = self._start, self._frame
        self._ends = dict.fromkeys((_HEAD, *_SHOULDERS), self._chest)

    def solve(self) -> ExtensionMotion:
        """Place all joints; return the extension with constants as they are described, and its values."""
        kinds = [kind for kind, _ in self._sources]
        offsets, drives, rests, values = [], [], [], []
        for index, (kind, source) in enumerate(self._sources):
            offset, orientation = self._place_joint(kind, source, self._find_target(index))
            parent = self._fit.joint_orientations[:, 0] if kind is JointKind.SPINE else self._chest[1]
            driver = find_driver(
                kind, self._fit.joint_positions, self._fit.joint_orientations, self._chest_before(kind, orientation)
            )
            turn = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(parent), orientation))
            drive, rest, value = _fit_drive(driver, turn, self._usual_share(index))
            offsets.append(offset)
            drives.append(drive)
            rests.append(rest)
            values.append(value)
        ends = [self._measure_end(joint) for joint in (_HEAD, *_SHOULDERS)]
        extension = BodyExtension(
            spine_count=kinds.count(JointKind.SPINE),
            has_neck=JointKind.NECK in kinds,
            has_clavicles=JointKind.LEFT_CLAVICLE in kinds,
            offsets=np.array(offsets),
            ends=np.array(ends),
            drive=np.array(drives),
            rest=np.array(rests),
        )
        return ExtensionMotion(extension, np.stack(values, axis=1), tuple(source for _, source in self._sources))

    def _usual_share(self, index: int) -> float:
        """Return the share of its driver with which a joint usually turns."""
        kind = self._sources[index][0]
        if kind is JointKind.SPINE:
            return (index + 1) / sum(each is JointKind.SPINE for each, _ in self._sources)
        return NECK_SHARE if kind is JointKind.NECK else 0.0

    def _chest_before(self, kind: JointKind, orientation: Array) -> Array:
        """Return the chest's orientation that the driver of a joint is relative to."""
        return orientation if kind is JointKind.SPINE else self._chest[1]

    def _find_target(self, index: int) -> int | None:
        """Return the source joint at which a joint aims; None for the chest."""
        kind = self._sources[index][0]
        if kind is JointKind.SPINE:
            following = self._sources[index + 1 : index + 2]
            return following[0][1] if following and following[0][0] is JointKind.SPINE else None
        end = _HEAD if kind is JointKind.NECK else _SHOULDERS[kind is JointKind.RIGHT_CLAVICLE]
        return self._fit.joints[end]

    def _place_joint(self, kind: JointKind, source: int, target: int | None) -> tuple[Array, Array]:
        """Place the joint that follows `source`; return its offset (3,) and its world orientation (n, 4).

        It aims at `target`, as the source may have further joints up to there.
        """
        fit = self._fit
        start, frame = (self._start, self._frame) if kind is JointKind.SPINE else self._chest
        offset = _round_lengths(mean_local_positions(frame, fit.position[:, [source]] - start[:, None])[0])
        place, orientation = start + rotation.rotate(frame, offset), fit.turn[:, source]
        if target is not None:
            aimed = fit.position[:, target]
            arm = mean_local_positions(orientation, aimed[:, None] - place[:, None])[0]
            orientation = aim_at(orientation, arm, place, aimed)
        if kind is JointKind.SPINE:
            self._start, self._frame = self._chest = place, orientation
            self._ends = dict.fromkeys(self._ends, self._chest)
        else:
            end = _HEAD if kind is JointKind.NECK else _SHOULDERS[kind is JointKind.RIGHT_CLAVICLE]
            self._ends[end] = place, orientation
        return offset, orientation

    def _measure_end(self, joint: int) -> Array:
        """Return the position (3,) of skullbase or a shoulder in the frame of the joint that carries it."""
        start, frame = self._ends[joint]
        source = self._fit.joints.get(joint)
        target = self._fit.joint_positions[:, joint] if source is None else self._fit.position[:, source]
        return _round_lengths(mean_local_positions(frame, (target - start)[:, None])[0])


def _fit_drive(driver: Array, turn: Array, usual_share: float) -> tuple[Array, Array, Array]:
    """Return the drive (3, 3) and rest (3,) with which a driver (n, 3) gives rotation vectors (n, 3), and the rest.

    Where the driver does not move, the drive is the usual share: it then carries the decoder's errors of the figure in
    the way in which the figure compensates them.
    """
    usual = usual_share * np.eye(3)
    centred, mean = driver - driver.mean(axis=0), turn.mean(axis=0)
    ridge = _RIDGE * len(driver) * np.eye(3)
    unexplained = turn - mean - centred @ usual
    drive = usual + np.linalg.solve(centred.T @ centred + ridge, centred.T @ unexplained).T
    drive = np.clip(np.round(drive / DRIVE_UNIT), -MAX_DRIVE, MAX_DRIVE) * DRIVE_UNIT
    rest = np.round((mean - drive @ driver.mean(axis=0)) / REST_UNIT_RAD) * REST_UNIT_RAD
    return drive, rest, turn - driver @ drive.T - rest


def _round_lengths(v: Array) -> Array:
    rounded: Array = np.round(v / LENGTH_UNIT_M) * LENGTH_UNIT_M
    return rounded
