"""Mirror images: left and right exchanged, by a reflection of the world in the plane x = 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bunraku.motion.extension import BodyExtension, JointKind
from bunraku.motion.face import AXIS_MIRRORS, Face
from bunraku.motion.hands import FINGERS, Hands
from bunraku.motion.placement import Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS, Figure, Motion

_REFLECTION = np.array([-1.0, 1.0, 1.0])
# the axis of a rotation is an axial vector: a reflection in x reverses its y and z
_ROTATION_REFLECTION = np.array([1.0, 1.0, -1.0, -1.0])


def opposite_joint(name: str) -> str:
    """Return the joint of the other side, or the joint itself if it is in the middle."""
    return {"l_": "r_", "r_": "l_"}.get(name[:2], name[:2]) + name[2:]


OPPOSITE_JOINTS: tuple[int, ...] = tuple(JOINT_INDEX[opposite_joint(name)] for name in JOINTS)
"""Index of the joint of the other side, for each joint."""
_OPPOSITE = list(OPPOSITE_JOINTS)


def mirror_vectors(vectors: Array) -> Array:
    """Return the mirror images of positions or directions (..., 3)."""
    mirrored: Array = vectors * _REFLECTION
    return mirrored


def mirror_figure(figure: Figure) -> Figure:
    """Return the figure with the bones of the other side."""
    return Figure(mirror_vectors(figure.offsets[_OPPOSITE]), mirror_vectors(figure.tips[_OPPOSITE]))


def mirror_motion(motion: Motion) -> Motion:
    """Return the mirror image of a motion. Mirroring it again gives the motion."""
    rotations: Array = motion.rotations[:, _OPPOSITE] * _ROTATION_REFLECTION
    return Motion(mirror_figure(motion.figure), motion.fps, mirror_vectors(motion.root), rotations)


def mirror_placement(placement: Placement) -> Placement:
    """Return the placement of a mirrored motion, so that the whole stage is mirrored."""
    # the subtraction leaves no negative zero
    return Placement(0.0 - placement.x, placement.z, 0.0 - placement.turn)


def mirror_heading(heading: float) -> float:
    """Return the mirror image of a direction, in radians about y from z towards x."""
    return 0.0 - heading


def mirror_body(extension: BodyExtension, values: Array) -> tuple[BodyExtension, Array]:
    """Return the mirror image of a body extension and of its values (n, E, 3)."""
    order = list(range(len(extension.offsets)))
    if extension.has_clavicles:
        order[-2:] = order[:-3:-1]
    turned = _ROTATION_REFLECTION[1:]
    # the driver of a clavicle is a direction, that of other joints a rotation vector
    drivers = np.array(
        [turned if kind in (JointKind.SPINE, JointKind.NECK) else _REFLECTION for kind in extension.kinds]
    )
    mirrored = replace(
        extension,
        offsets=mirror_vectors(extension.offsets[order]),
        ends=mirror_vectors(extension.ends[[0, 2, 1]]),
        drive=extension.drive[order] * turned[:, None] * drivers[:, None, :],
        rest=extension.rest[order] * turned,
    )
    return mirrored, values[:, order] * turned


def mirror_hands(hands: Hands, values: Array) -> tuple[Hands, Array]:
    """Return the mirror images of fingers and of their values (n, E, 3)."""
    chains = [*range(len(FINGERS), 2 * len(FINGERS)), *range(len(FINGERS))]
    counts = tuple(hands.counts[chain] for chain in chains)
    joints = {joint: index for index, joint in enumerate(hands.joints)}
    mirrored = Hands(counts, mirror_vectors(hands.bases[chains]), hands.lengths[chains])
    order = [joints[chains[chain], place] for chain, place in mirrored.joints]
    return mirrored, values[:, order] * _ROTATION_REFLECTION[1:]


def mirror_face(face: Face, values: Array) -> tuple[Face, Array]:
    """Return the mirror image of a face and of the values (n, C, 3) of its channels."""
    signs = np.ones(values[0].size)
    signs[: len(face.axes)] = AXIS_MIRRORS[list(face.axes)]
    return face, values * signs.reshape(-1, 3)
