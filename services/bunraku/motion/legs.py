"""Standing: the hips placed so that the weight is where it must be, and legs that reach both feet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bunraku.motion import mass, rotation, skeleton, two_bone
from bunraku.motion.footwork import Foot
from bunraku.motion.rotation import Array
from bunraku.motion.score import Side
from bunraku.motion.skeleton import INDEX, Figure

SPARE = 0.002
"""Metres by which a leg stays shorter than it is at rest, so that the knee never locks."""
SOFTNESS = 0.008
"""Metres over which the hips yield to a leg that becomes too short, instead of stopping dead."""
_ROUNDS = 5
"""Each round leaves about a fifth of the error of the weight: five leave less than a tenth of a millimetre."""
_TOES: dict[Side, int] = {"left": mass.LEFT_TOES, "right": mass.RIGHT_TOES}


def stand(
    figure: Figure, rotations: Array, feet: Mapping[Side, Foot], facing: Array, height: Array, weight: Array
) -> Array:
    """Sets hips, knees, ankles and toes in `rotations` (n, 18, 4) and returns the root's position (n, 3) in metres.

    All other rotations are given; so are `feet`, where the hips face (n,) in radians, the `height` (n,) in metres
    that the root has if the legs are long enough for it, and where the centre of mass is to be, `weight` (n, 2), x
    and z in metres.
    """
    nowhere = np.zeros((len(rotations), 3))
    still = skeleton.points(figure, nowhere, rotations)
    root = np.stack([weight[:, 0], height, weight[:, 1]], axis=-1)
    for _ in range(_ROUNDS):
        root[:, 1] = _within_reach(figure, feet, root, still, height)
        body = still + root[:, None]
        for side, foot in feet.items():
            hip, knee, ankle, toes = _joints(side)
            thigh, _bend = _leg(figure, side, foot, body[:, hip], facing)
            body[:, knee] = body[:, hip] + rotation.rotate(thigh, figure.offsets[knee])
            body[:, ankle] = foot.ankle
            body[:, toes] = foot.ankle + rotation.rotate(foot.orientation, figure.offsets[toes])
            body[:, _TOES[side]] = body[:, toes] + rotation.rotate(foot.orientation, figure.tips[toes])
        root[:, [0, 2]] += weight - mass.centre_of_mass(body)[:, [0, 2]]
    root[:, 1] = _within_reach(figure, feet, root, still, height)
    pelvis = rotation.multiply(rotations[:, 0], rotations[:, INDEX["sacroiliac"]])
    for side, foot in feet.items():
        hip, knee, ankle, toes = _joints(side)
        thigh, bend = _leg(figure, side, foot, root + still[:, hip], facing)
        rotations[:, hip] = rotation.multiply(rotation.conjugate(pelvis), thigh)
        rotations[:, knee] = rotation.about_axis(0, bend)
        shin = rotation.multiply(thigh, rotations[:, knee])
        rotations[:, ankle] = rotation.multiply(rotation.conjugate(shin), foot.orientation)
        rotations[:, toes] = rotation.about_axis(0, -foot.toes)
    return root


def _joints(side: Side) -> tuple[int, int, int, int]:
    hip, knee, ankle, toes = (INDEX[f"{side[0]}_{joint}"] for joint in ("hip", "knee", "ankle", "midtarsal"))
    return hip, knee, ankle, toes


def _leg(figure: Figure, side: Side, foot: Foot, hip: Array, facing: Array) -> tuple[Array, Array]:
    """World orientation of the thigh (n, 4) and bend of the knee (n,) of a leg from `hip` (n, 3) to the foot.

    The knee points between the hips' facing and the foot's, and 8 degrees out.
    """
    forward = 0.5 * (facing + foot.facing) + np.radians(8.0 if side == "left" else -8.0)
    pole = np.stack([np.sin(forward), np.zeros_like(forward), np.cos(forward)], axis=-1)
    _, knee, ankle, _ = _joints(side)
    return two_bone.solve(figure.offsets[knee], figure.offsets[ankle], foot.ankle - hip, pole, two_bone.KNEE)


def _within_reach(figure: Figure, feet: Mapping[Side, Foot], root: Array, still: Array, height: Array) -> Array:
    """The root's height (n,): `height`, or less where a leg would be too short; a smooth minimum, below all limits."""
    limits = [height]
    for side, foot in feet.items():
        hip, knee, ankle, _ = _joints(side)
        longest = two_bone.reach(figure.offsets[knee], figure.offsets[ankle]) - SPARE
        aside = np.sum((root + still[:, hip] - foot.ankle)[:, [0, 2]] ** 2, axis=-1)
        limits.append(foot.ankle[:, 1] - still[:, hip, 1] + np.sqrt(np.clip(longest**2 - aside, 0.0, None)))
    lowest = np.min(limits, axis=0)
    soft: Array = lowest - SOFTNESS * np.log(np.sum(np.exp((lowest - np.array(limits)) / SOFTNESS), axis=0))
    return soft
