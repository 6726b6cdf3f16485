"""Stance: hips placed so that the weight is at its target, and legs that reach both feet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bunraku.demo import mass, two_bone_ik
from bunraku.demo.footwork import FootTrack
from bunraku.demo.score import Side
from bunraku.motion import rotation, skeleton
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure

KNEE_CLEARANCE_M = 0.002
"""Distance by which a leg stays shorter than at rest, so that the knee never locks."""
REACH_SOFTNESS_M = 0.008
"""Range over which the hips yield to a leg that becomes too short, instead of stopping abruptly."""
_BALANCE_ITERATIONS = 5
"""Each iteration leaves about a fifth of the error of the weight: five leave less than 0.1 mm."""
_TOE_TIPS: dict[Side, int] = {"left": mass.LEFT_TOES, "right": mass.RIGHT_TOES}


def solve_stance(
    figure: Figure, rotations: Array, feet: Mapping[Side, FootTrack], facing: Array, height: Array, weight_target: Array
) -> Array:
    """Set hips, knees, ankles and toes in `rotations` (n, 18, 4) and return the root's position (n, 3) in metres.

    All other rotations are given; so are `feet`, the hips' `facing` (n,) in radians, the `height` (n,) in metres that
    the root has if the legs are long enough, and `weight_target` (n, 2), x and z of the centre of mass in metres.
    """
    nowhere = np.zeros((len(rotations), 3))
    still = skeleton.joint_and_tip_positions(figure, nowhere, rotations)
    root = np.stack([weight_target[:, 0], height, weight_target[:, 1]], axis=-1)
    for _ in range(_BALANCE_ITERATIONS):
        root[:, 1] = _reachable_height(figure, feet, root, still, height)
        body = still + root[:, None]
        for side, foot in feet.items():
            hip, knee, ankle, toes = _leg_joints(side)
            thigh, _bend = _solve_leg(figure, side, foot, body[:, hip], facing)
            body[:, knee] = body[:, hip] + rotation.rotate(thigh, figure.offsets[knee])
            body[:, ankle] = foot.ankle_position
            body[:, toes] = foot.ankle_position + rotation.rotate(foot.orientation, figure.offsets[toes])
            body[:, _TOE_TIPS[side]] = body[:, toes] + rotation.rotate(foot.orientation, figure.tips[toes])
        root[:, [0, 2]] += weight_target - mass.centre_of_mass(body)[:, [0, 2]]
    root[:, 1] = _reachable_height(figure, feet, root, still, height)
    pelvis = rotation.multiply(rotations[:, 0], rotations[:, JOINT_INDEX["sacroiliac"]])
    for side, foot in feet.items():
        hip, knee, ankle, toes = _leg_joints(side)
        thigh, bend = _solve_leg(figure, side, foot, root + still[:, hip], facing)
        rotations[:, hip] = rotation.multiply(rotation.conjugate(pelvis), thigh)
        rotations[:, knee] = rotation.from_coordinate_axis(0, bend)
        shin = rotation.multiply(thigh, rotations[:, knee])
        rotations[:, ankle] = rotation.multiply(rotation.conjugate(shin), foot.orientation)
        rotations[:, toes] = rotation.from_coordinate_axis(0, -foot.toe_bend)
    return root


def _leg_joints(side: Side) -> tuple[int, int, int, int]:
    hip, knee, ankle, toes = (JOINT_INDEX[f"{side[0]}_{joint}"] for joint in ("hip", "knee", "ankle", "midtarsal"))
    return hip, knee, ankle, toes


def _solve_leg(figure: Figure, side: Side, foot: FootTrack, hip: Array, facing: Array) -> tuple[Array, Array]:
    """Return world orientation of the thigh (n, 4) and bend of the knee (n,) of a leg from `hip` (n, 3) to the foot.

    The knee points between the hips' facing and the foot's, and 8 degrees out.
    """
    forward = 0.5 * (facing + foot.facing) + np.radians(8.0 if side == "left" else -8.0)
    pole = np.stack([np.sin(forward), np.zeros_like(forward), np.cos(forward)], axis=-1)
    _, knee, ankle, _ = _leg_joints(side)
    return two_bone_ik.solve_two_bone(
        figure.offsets[knee], figure.offsets[ankle], foot.ankle_position - hip, pole, two_bone_ik.KNEE_SIGN
    )


def _reachable_height(
    figure: Figure, feet: Mapping[Side, FootTrack], root: Array, local_points: Array, height: Array
) -> Array:
    """Return the root's height (n,): `height`, or less if a leg would be too short; a smooth minimum below all
    limits."""
    limits = [height]
    for side, foot in feet.items():
        hip, knee, ankle, _ = _leg_joints(side)
        longest = two_bone_ik.end_distance(figure.offsets[knee], figure.offsets[ankle]) - KNEE_CLEARANCE_M
        horizontal = np.sum((root + local_points[:, hip] - foot.ankle_position)[:, [0, 2]] ** 2, axis=-1)
        limits.append(
            foot.ankle_position[:, 1] - local_points[:, hip, 1] + np.sqrt(np.clip(longest**2 - horizontal, 0.0, None))
        )
    lowest = np.min(limits, axis=0)
    soft: Array = lowest - REACH_SOFTNESS_M * np.log(
        np.sum(np.exp((lowest - np.array(limits)) / REACH_SOFTNESS_M), axis=0)
    )
    return soft
