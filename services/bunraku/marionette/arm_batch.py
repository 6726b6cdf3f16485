"""Many arms at once: hand tips in, places of elbow, wrist and tip out, by square roots alone.

The same arm as `arm`, without trigonometry. A planar place is a complex number x + iy; an elbow is the tip times a
number that closes the triangle of upper arm, the rest of the arm, and the line to the tip; the forearm's direction is
the line from elbow to tip over the rest's own shape. Angles are made from the places, where somebody asks for them.

In space the shoulder is the origin and y is up; the azimuth of the plane is from z (forwards) towards x.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from bunraku.marionette.arm import BendTable, folded_elbow
from bunraku.marionette.planar_arm import TABLE_SIDE
from bunraku.marionette.proportions import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD, Proportions
from bunraku.motion.rotation import Array

CHUNK_ARMS = 8192
"""Arms that are solved together, so that what lies between is still in the processor's cache."""
MIN_TARGET_DISTANCE = 1e-12
"""A target nearer to the shoulder than this has no direction to keep."""
_MIN_HORIZONTAL_DISTANCE = 1e-150
"""A level distance is 0 below this: far under any that matters, far above where a square loses digits."""


class ArmConstants(NamedTuple):
    """An arm in the numbers that solving takes. Lengths are in arm lengths; a half bend is told by its sine."""

    upper: float
    forearm: float
    hand: float
    min_tip_distance: float
    """The nearest that a tip is solved for."""
    inverse_distance_range: float
    """1 / (1 - inner)."""
    straight_elbow_factor: float
    """Times 1 - r^2: the squared sine of the half bend with which the wrist reaches r, the elbow being straight."""
    folded_elbow_factor: float
    """1 / (4 d hand): as `straight`, the elbow being at its limit and the wrist d from the shoulder."""
    folded_near_squared: float
    """(d - hand)^2."""
    folded_far_squared: float
    """(d + hand)^2."""
    half_lean_sine: float
    """Sine of half the angle between the line to that wrist and the folded forearm, negative; `lean_cosine` alike."""
    half_lean_cosine: float
    max_half_bend_sine: float
    """The wrist's own limit."""


def arm_constants(proportions: Proportions) -> ArmConstants:
    """What `place` needs of an arm with these proportions."""
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
    """Sine and cosine of the azimuth, then elbow, wrist and tip (each x, y, z) for a hand tip at (x, y, z).

    One set of formulae for arrays (n,) and, compiled, for single numbers. `nodes` is the table, flat, in float64. A
    target out of reach is brought in with its direction kept; the shoulder itself counts as straight below.
    """
    flat = x * x + z * z
    level, reach = np.sqrt(flat), np.sqrt(flat + y * y)
    lost = reach < MIN_TARGET_DISTANCE
    found = 1.0 - lost
    x, y, z, level = x * found, y * found - MIN_TARGET_DISTANCE * lost, z * found, level * found
    reach = np.maximum(reach, MIN_TARGET_DISTANCE)
    # on the axis the plane is the one that faces forwards
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
    # half of an angle sum: the folded elbow's lean, and the bend that reaches r from there
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
    # the rest of the arm, seen along the forearm, and the triangle it makes with the upper arm
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
    """Solved arms: `solved` (11, n) as `place` gives it. Angles in radians, places in arm lengths, y up."""

    rows: Array

    @property
    def azimuth(self) -> Array:
        """The plane's azimuth (n,), from z towards x."""
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
        """Angles t0, t1, t2 (n,) of the links in their plane, from the horizontal upwards, as `Arm.angles` has them."""
        elbow, wrist, tip = (
            self.rows[at] * self.rows[0] + self.rows[at + 2] * self.rows[1] + 1j * self.rows[at + 1] for at in (2, 5, 8)
        )
        fore = wrist - elbow
        # each turn by itself, none of them beyond half a turn, so that nothing wraps
        t0 = np.angle(tip) - np.angle(tip * elbow.conj())
        t1 = t0 + np.angle(fore * elbow.conj())
        t2 = t1 + np.angle((tip - wrist) * fore.conj())
        return t0, t1, t2


def solve_arms(proportions: Proportions, table: BendTable, targets: Array) -> SolvedArms:
    """The arms whose tips are at `targets` (n, 3), in arm lengths with y up.

    A target nearer than the inner radius or farther than the arm is brought to the limit with its direction kept; one
    at the shoulder itself counts as straight below. Straight above or below, the plane is the one that faces forwards.
    """
    targets = np.asarray(targets, dtype=np.float64)
    shape, nodes = arm_constants(proportions), table.astype(np.float64).ravel()
    solved = np.empty((11, len(targets)))
    for start in range(0, len(targets), CHUNK_ARMS):
        x, y, z = np.ascontiguousarray(targets[start : start + CHUNK_ARMS].T)
        for row, values in zip(solved, solve_tip(shape, nodes, x, y, z), strict=True):
            row[start : start + CHUNK_ARMS] = values
    return SolvedArms(solved)
