"""Many arms at once: positions of elbow, wrist and tip from hand targets, with square roots alone.

The arm is that of `arm`, without trigonometry. A position in the plane is a complex number x + iy. The elbow is the tip
times a number that closes the triangle of upper arm, rest of the arm, and chord; the forearm's direction is the line
from elbow to tip divided by the shape of the rest. Angles are computed from the positions on request.

In space the shoulder is the origin and y is up; the azimuth of the plane is from z (forwards) towards x.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from bunraku.marionette.arm import BendTable, folded_elbow
from bunraku.marionette.constants import (
    MAX_ELBOW_BEND_RAD,
    MAX_TIP_DISTANCE,
    MAX_WRIST_BEND_RAD,
    MIN_TARGET_DISTANCE,
    TABLE_SIDE,
)
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

CHUNK_ARMS = 8192
"""Arms solved together, so that intermediate results stay in the processor's cache."""
_MIN_HORIZONTAL_DISTANCE = 1e-150
"""Horizontal distance below which the tip counts as on the axis.

Far below any that matters, and far above those whose square loses digits.
"""


class ArmConstants(NamedTuple):
    """Numbers that depend on the arm's proportions only. Lengths are in arm lengths; half bends are sines."""

    upper: float
    forearm: float
    hand: float
    min_tip_distance: float
    """Smallest solved distance of the tip."""
    inverse_distance_range: float
    """1 / (1 - min_tip_distance)."""
    straight_elbow_factor: float
    """Factor of 1 - r^2 in the squared sine of half the wrist bend that reaches r with a straight elbow."""
    folded_elbow_factor: float
    """1 / (4 d hand): the same with the elbow at its limit, the wrist at distance d from the shoulder."""
    folded_near_squared: float
    """(d - hand)^2."""
    folded_far_squared: float
    """(d + hand)^2."""
    half_lean_sine: float
    """Sine of half the angle between the segment to that wrist and the folded forearm; negative."""
    half_lean_cosine: float
    max_half_bend_sine: float
    """Limit of the wrist."""


def arm_constants(proportions: Proportions) -> ArmConstants:
    """Return the constants of an arm with these proportions."""
    upper, fore, hand = proportions.lengths
    inner = proportions.min_tip_distance
    distance, angle = folded_elbow(proportions)
    half_lean = 0.5 * (angle - MAX_ELBOW_BEND_RAD)
    return ArmConstants(
        upper,
        fore,
        hand,
        inner,
        1.0 / (1.0 - inner),
        1.0 / (4.0 * (upper + fore) * hand),
        1.0 / (4.0 * distance * hand),
        (distance - hand) ** 2,
        (distance + hand) ** 2,
        sin(half_lean),
        cos(half_lean),
        sin(0.5 * MAX_WRIST_BEND_RAD),
    )


def solve_tip(constants: ArmConstants, nodes: Array, x: Any, y: Any, z: Any) -> Any:
    """Return sine and cosine of the azimuth, then elbow, wrist and tip (x, y, z each) for a target at (x, y, z).

    The formulae are the same for arrays (n,) and, compiled, for single numbers. `nodes` is the flat table in float64. A
    target out of reach is moved into reach along its direction; the shoulder itself counts as straight below.
    """
    flat = x * x + z * z
    level, reach = np.sqrt(flat), np.sqrt(flat + y * y)
    at_shoulder = reach < MIN_TARGET_DISTANCE
    found = 1.0 - at_shoulder
    x, y, z, level = x * found, y * found - MIN_TARGET_DISTANCE * at_shoulder, z * found, level * found
    reach = np.maximum(reach, MIN_TARGET_DISTANCE)
    # on the axis the plane faces forwards
    off, across = level >= _MIN_HORIZONTAL_DISTANCE, np.maximum(level, _MIN_HORIZONTAL_DISTANCE)
    sine, cosine = x * off / across, (z * off + _MIN_HORIZONTAL_DISTANCE * (1.0 - off)) / across
    r = np.minimum(np.maximum(reach, constants.min_tip_distance), MAX_TIP_DISTANCE)
    q = np.sqrt((1.0 - r) * constants.inverse_distance_range)
    u = (1.0 - q) * (1.0 + 0.75 * q) * (TABLE_SIDE - 1)
    v = (0.5 + 0.5 * y / (level + np.abs(y))) * (TABLE_SIDE - 1)
    i, j = np.int64(np.minimum(u, TABLE_SIDE - 2)), np.int64(np.minimum(v, TABLE_SIDE - 2))
    u, v, node = u - i, v - j, i * TABLE_SIDE + j
    inside = nodes[node] + (nodes[node + 1] - nodes[node]) * v
    outside = nodes[node + TABLE_SIDE] + (nodes[node + TABLE_SIDE + 1] - nodes[node + TABLE_SIDE]) * v
    share = inside + (outside - inside) * u
    square = r * r
    greatest = np.minimum(constants.max_half_bend_sine, np.sqrt((1.0 - square) * constants.straight_elbow_factor))
    # sine of half an angle sum: the lean of the folded elbow and the bend that reaches r from there
    bend_sine = np.sqrt(
        np.minimum(np.maximum((constants.folded_far_squared - square) * constants.folded_elbow_factor, 0.0), 1.0)
    )
    bend_cosine = np.sqrt(
        np.minimum(np.maximum((square - constants.folded_near_squared) * constants.folded_elbow_factor, 0.0), 1.0)
    )
    least = np.maximum(constants.half_lean_sine * bend_cosine + constants.half_lean_cosine * bend_sine, 0.0)
    least = np.minimum(least, greatest)
    half = least + share * (greatest - least)
    cos_bend, sin_bend = 1.0 - 2.0 * half * half, 2.0 * half * np.sqrt(1.0 - half * half)
    # the rest of the arm in the frame of the forearm, and its triangle with the upper arm
    rest_x, rest_y = constants.forearm + constants.hand * cos_bend, constants.hand * sin_bend
    rest = (constants.forearm + constants.hand) ** 2 - 4.0 * constants.forearm * constants.hand * half * half
    along = (constants.upper * constants.upper + square - rest) * 0.5 / square
    below = np.sqrt(np.maximum(constants.upper * constants.upper / square - along * along, 0.0))
    level, y = level * (r / reach), y * (r / reach)
    elbow_x, elbow_y = level * along + y * below, y * along - level * below
    rest_x, rest_y, chord_x, chord_y = rest_x / rest, rest_y / rest, level - elbow_x, y - elbow_y
    fore_x, fore_y = chord_x * rest_x + chord_y * rest_y, chord_y * rest_x - chord_x * rest_y
    wrist_x, wrist_y = elbow_x + constants.forearm * fore_x, elbow_y + constants.forearm * fore_y
    tip_x = wrist_x + constants.hand * (fore_x * cos_bend - fore_y * sin_bend)
    tip_y = wrist_y + constants.hand * (fore_y * cos_bend + fore_x * sin_bend)
    return (
        sine,
        cosine,
        elbow_x * sine,
        elbow_y,
        elbow_x * cosine,
        wrist_x * sine,
        wrist_y,
        wrist_x * cosine,
        tip_x * sine,
        tip_y,
        tip_x * cosine,
    )


@dataclass(frozen=True, slots=True)
class SolvedArms:
    """Solved arms: `rows` (11, n) as `solve_tip` returns them. Angles in radians, positions in arm lengths, y up."""

    rows: Array

    @property
    def azimuth(self) -> Array:
        """Azimuth (n,) of the plane, from z towards x."""
        azimuth: Array = np.arctan2(self.rows[0], self.rows[1])
        return azimuth

    @property
    def elbow(self) -> Array:
        """Elbows (n, 3)."""
        return self.rows[2:5].T

    @property
    def wrist(self) -> Array:
        """Wrists (n, 3)."""
        return self.rows[5:8].T

    @property
    def tip(self) -> Array:
        """Hand tips (n, 3)."""
        return self.rows[8:11].T

    def angles(self) -> tuple[Array, Array, Array]:
        """Return the link angles t0, t1, t2 (n,) in their plane, from the horizontal upwards."""
        elbow, wrist, tip = (
            self.rows[at] * self.rows[0] + self.rows[at + 2] * self.rows[1] + 1j * self.rows[at + 1] for at in (2, 5, 8)
        )
        fore = wrist - elbow
        # each angle by itself: none exceeds half a turn, so none wraps
        t0 = np.angle(tip) - np.angle(tip * elbow.conj())
        t1 = t0 + np.angle(fore * elbow.conj())
        t2 = t1 + np.angle((tip - wrist) * fore.conj())
        return t0, t1, t2


def solve_arms(proportions: Proportions, table: BendTable, targets: Array) -> SolvedArms:
    """Return the arms with their tips at `targets` (n, 3), in arm lengths with y up.

    A target out of reach is moved into reach along its direction; the shoulder itself counts as straight below.
    Straight above or below the shoulder, the plane of the arm faces forwards.
    """
    targets = np.asarray(targets, dtype=np.float64)
    constants, nodes = arm_constants(proportions), table.astype(np.float64).ravel()
    solved = np.empty((11, len(targets)))
    for start in range(0, len(targets), CHUNK_ARMS):
        x, y, z = np.ascontiguousarray(targets[start : start + CHUNK_ARMS].T)
        for row, values in zip(solved, solve_tip(constants, nodes, x, y, z), strict=True):
            row[start : start + CHUNK_ARMS] = values
    return SolvedArms(solved)
