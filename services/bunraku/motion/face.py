"""Face of a performer: weights of expressions, and the axes that they are coded in (proto/codec.md, 2.19).

Expressions are the 52 blend shapes of ARKit (ARFaceAnchor.BlendShapeLocation), the presets of VRM 1.0
(VRMC_vrm-1.0, expressions.md), and the direction of the eyes. An axis is one expression, the sum or difference of the
expressions of both sides, or the difference of two that exclude each other, like a jaw to the left and to the right.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

_SINGLE = (
    "jawForward",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "browInnerUp",
    "cheekPuff",
    "tongueOut",
)
_PAIRED = (
    "eyeBlink",
    "eyeSquint",
    "eyeWide",
    "mouthSmile",
    "mouthFrown",
    "mouthDimple",
    "mouthStretch",
    "mouthPress",
    "mouthLowerDown",
    "mouthUpperUp",
    "browDown",
    "browOuterUp",
    "cheekSquint",
    "noseSneer",
)
_VRM_SINGLE = (
    "happy",
    "angry",
    "sad",
    "relaxed",
    "surprised",
    "neutral",
    "aa",
    "ih",
    "ou",
    "ee",
    "oh",
    "blink",
)
GAZE = ("gazeYaw", "gazePitch")
"""Direction of both eyes relative to the head, in radians: to the performer's left, and up."""
MAX_GAZE_RAD = np.pi / 2
MIN_EYE_TURN_RAD, MAX_EYE_TURN_RAD = np.radians(1.0), np.radians(60.0)
"""Eyes that turn by less stand still; those that are mostly farther aside than the second do not show a gaze."""
MIN_WEIGHT = 1e-3
"""An axis that never exceeds this is not coded."""

_LEFT_EYE_LOOK = (("eyeLookOutLeft", "eyeLookInLeft"), ("eyeLookUpLeft", "eyeLookDownLeft"))
_RIGHT_EYE_LOOK = (("eyeLookInRight", "eyeLookOutRight"), ("eyeLookUpRight", "eyeLookDownRight"))

Term = tuple[str, ...]
"""One expression, or two that exclude each other: the weight of the first minus that of the second."""
TERMS: tuple[tuple[Term, ...], ...] = (
    *(((name,),) for name in _SINGLE),
    *(((f"{name}Left",), (f"{name}Right",)) for name in _PAIRED),
    (("jawLeft", "jawRight"),),
    (("mouthLeft", "mouthRight"),),
    *zip(_LEFT_EYE_LOOK, _RIGHT_EYE_LOOK, strict=True),
    *(((name,),) for name in _VRM_SINGLE),
    (("blinkLeft",), ("blinkRight",)),
    (("lookLeft", "lookRight"),),
    (("lookUp", "lookDown"),),
    *(((name,),) for name in GAZE),
)
"""Terms that are coded together: one has one axis; two have two, their sum and their difference over sqrt(2)."""
EXPRESSIONS: tuple[str, ...] = tuple(name for terms in TERMS for term in terms for name in term)
"""Names of all expressions, in the order of the axes."""
EXPRESSION_INDEX: dict[str, int] = {name: index for index, name in enumerate(EXPRESSIONS)}
AXIS_COUNT = sum(map(len, TERMS))


def _axis_matrix() -> Array:
    """Return the matrix (64, 72) from expressions to axes; its rows are the contributions of the expressions."""
    matrix = np.zeros((AXIS_COUNT, len(EXPRESSIONS)))
    axis = 0
    for terms in TERMS:
        signed = [{name: 1.0 - 2.0 * place for place, name in enumerate(term)} for term in terms]
        for row in range(len(terms)):
            for number, term in enumerate(signed):
                share = 1.0 if len(terms) == 1 else np.sqrt(0.5) * (-1.0 if row and number else 1.0)
                for name, sign in term.items():
                    matrix[axis + row, EXPRESSION_INDEX[name]] = share * sign
        axis += len(terms)
    return matrix


_AXES = _axis_matrix()
_LOWEST = np.array([-MAX_GAZE_RAD if name in GAZE else 0.0 for name in EXPRESSIONS])
_HIGHEST = np.array([MAX_GAZE_RAD if name in GAZE else 1.0 for name in EXPRESSIONS])


def _axis_mirrors() -> Array:
    """Return the sign (64,) that each axis has in the mirror image of a face, where left and right are exchanged."""
    opposite = {"Left": "Right", "Right": "Left"}
    exchanged = [re.sub("Left|Right", lambda side: opposite[side[0]], name) for name in EXPRESSIONS]
    signs = np.array([-1.0 if name == "gazeYaw" else 1.0 for name in EXPRESSIONS])
    image = _AXES[:, [EXPRESSION_INDEX[name] for name in exchanged]] * signs
    mirrors: Array = np.sign(np.sum(image * _AXES, axis=1))
    return mirrors


AXIS_MIRRORS = _axis_mirrors()


@dataclass(frozen=True, slots=True)
class Face:
    """Axes of a performer's face that are coded: their numbers, ascending."""

    axes: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Expressions to which the axes contribute."""
        used = np.flatnonzero(_AXES[list(self.axes)].any(axis=0))
        return tuple(EXPRESSIONS[index] for index in used)


def face_of(expressions: dict[str, Array]) -> tuple[Face, Array]:
    """Return a face with the axes that `expressions` use, and the values (n, C, 3) of its channels.

    A channel has three axes; those that the last one lacks are zero.

    `expressions` maps names to weights (n,). Of two that exclude each other, the difference is kept. Raises `KeyError`
    if a name is unknown.
    """
    n = len(next(iter(expressions.values())))
    weights = np.zeros((n, len(EXPRESSIONS)))
    for name, weight in expressions.items():
        index = EXPRESSION_INDEX[name]
        weights[:, index] = np.clip(weight, _LOWEST[index], _HIGHEST[index])
    values = weights @ _AXES.T
    axes = np.flatnonzero(np.abs(values).max(axis=0) > MIN_WEIGHT)
    channels = np.zeros((n, 3 * -(-len(axes) // 3)))
    channels[:, : len(axes)] = values[:, axes]
    return Face(tuple(axes.tolist())), channels.reshape(n, -1, 3)


def gaze_of_eyes(turns: Array) -> dict[str, Array] | None:
    """Return the gaze (n,) of the rotations (n, m, 4) of eyes from straight ahead, relative to the head.

    The axes are those of a figure that faces z. None if the eyes stand still, or do not look ahead at rest.
    """
    ahead = rotation.rotate(turns, np.array([0.0, 0.0, 1.0])).mean(axis=1)
    yaw = np.arctan2(ahead[:, 0], ahead[:, 2])
    pitch = np.arctan2(ahead[:, 1], np.hypot(ahead[:, 0], ahead[:, 2]))
    moves = max(np.ptp(yaw), np.ptp(pitch)) >= MIN_EYE_TURN_RAD
    is_ahead = max(np.median(np.abs(yaw)), np.median(np.abs(pitch))) <= MAX_EYE_TURN_RAD
    return dict(zip(GAZE, (yaw, pitch), strict=True)) if moves and is_ahead else None


def shows_gaze(expressions: dict[str, Array]) -> bool:
    """Return whether expressions turn the eyes."""
    return any(
        re.match("gaze|look|eyeLook", name) and np.abs(weights).max() > MIN_WEIGHT
        for name, weights in expressions.items()
    )


def face_expressions(face: Face, values: Array) -> Array:
    """Return the weights (n, 72) of `EXPRESSIONS` for values (n, C, 3) of a face's channels: 0..1, gaze in radians."""
    weights: Array = values.reshape(len(values), -1)[:, : len(face.axes)] @ _AXES[list(face.axes)]
    # the columns of two expressions that exclude each other are opposite, so that one of them is negative
    clipped: Array = np.clip(weights, _LOWEST, _HIGHEST)
    return clipped
