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

from bunraku.marionette.arm import Table, folded_elbow
from bunraku.marionette.links import SIDE
from bunraku.marionette.proportions import ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, Proportions
from bunraku.motion.rotation import Array

CHUNK = 8192
"""Arms that are solved together, so that what lies between is still in the processor's cache."""
NOWHERE = 1e-12
"""A target nearer to the shoulder than this has no direction to keep."""
_ON_AXIS = 1e-150
"""A level distance is 0 below this: far under any that matters, far above where a square loses digits."""


class Shape(NamedTuple):
    """An arm in the numbers that solving takes. Lengths are in arm lengths; a half bend is told by its sine."""

    upper: float
    fore: float
    hand: float
    inner: float
    """The nearest that a tip is solved for."""
    rows: float
    """1 / (1 - inner)."""
    straight: float
    """Times 1 - r^2: the squared sine of the half bend with which the wrist reaches r, the elbow being straight."""
    folded: float
    """1 / (4 d hand): as `straight`, the elbow being at its limit and the wrist d from the shoulder."""
    near: float
    """(d - hand)^2."""
    far: float
    """(d + hand)^2."""
    lean_sine: float
    """Sine of half the angle between the line to that wrist and the folded forearm, negative; `lean_cosine` alike."""
    lean_cosine: float
    widest: float
    """The wrist's own limit."""


def shape_of(proportions: Proportions) -> Shape:
    """What `place` needs of an arm with these proportions."""
    upper, fore, hand = proportions.lengths
    inner = proportions.inner_radius
    distance, angle = folded_elbow(proportions)
    half_lean = 0.5 * (angle - ELBOW_LIMIT)
    return Shape(
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
        sin(0.5 * WRIST_LIMIT),
    )


def place(shape: Shape, nodes: Array, x: Any, y: Any, z: Any) -> Any:
    """Sine and cosine of the azimuth, then elbow, wrist and tip (each x, y, z) for a hand tip at (x, y, z).

    One set of formulae for arrays (n,) and, compiled, for single numbers. `nodes` is the table, flat, in float64. A
    target out of reach is brought in with its direction kept; the shoulder itself counts as straight below.
    """
    flat = x * x + z * z
    level, reach = np.sqrt(flat), np.sqrt(flat + y * y)
    lost = reach < NOWHERE
    found = 1.0 - lost
    x, y, z, level = x * found, y * found - NOWHERE * lost, z * found, level * found
    reach = np.maximum(reach, NOWHERE)
    # on the axis the plane is the one that faces forwards
    off, across = level >= _ON_AXIS, np.maximum(level, _ON_AXIS)
    sine, cosine = x * off / across, (z * off + _ON_AXIS * (1.0 - off)) / across
    r = np.minimum(np.maximum(reach, shape.inner), OUTER_RADIUS)
    q = np.sqrt((1.0 - r) * shape.rows)
    u = (1.0 - q) * (1.0 + 0.75 * q) * (SIDE - 1)
    v = (0.5 + 0.5 * y / (level + np.abs(y))) * (SIDE - 1)
    i, j = np.int64(np.minimum(u, SIDE - 2)), np.int64(np.minimum(v, SIDE - 2))
    u, v, node = u - i, v - j, i * SIDE + j
    inside = nodes[node] + (nodes[node + 1] - nodes[node]) * v
    outside = nodes[node + SIDE] + (nodes[node + SIDE + 1] - nodes[node + SIDE]) * v
    share = inside + (outside - inside) * u
    square = r * r
    greatest = np.minimum(shape.widest, np.sqrt((1.0 - square) * shape.straight))
    # half of an angle sum: the folded elbow's lean, and the bend that reaches r from there
    bend_sine = np.sqrt(np.minimum(np.maximum((shape.far - square) * shape.folded, 0.0), 1.0))
    bend_cosine = np.sqrt(np.minimum(np.maximum((square - shape.near) * shape.folded, 0.0), 1.0))
    least = np.maximum(shape.lean_sine * bend_cosine + shape.lean_cosine * bend_sine, 0.0)
    least = np.minimum(least, greatest)
    half = least + share * (greatest - least)
    cos_bend, sin_bend = 1.0 - 2.0 * half * half, 2.0 * half * np.sqrt(1.0 - half * half)
    # the rest of the arm, seen along the forearm, and the triangle it makes with the upper arm
    rest_x, rest_y = shape.fore + shape.hand * cos_bend, shape.hand * sin_bend
    rest = (shape.fore + shape.hand) ** 2 - 4.0 * shape.fore * shape.hand * half * half
    along = (shape.upper * shape.upper + square - rest) * 0.5 / square
    below = np.sqrt(np.maximum(shape.upper * shape.upper / square - along * along, 0.0))
    level, y = level * (r / reach), y * (r / reach)
    elbow_x, elbow_y = level * along + y * below, y * along - level * below
    rest_x, rest_y, chord_x, chord_y = rest_x / rest, rest_y / rest, level - elbow_x, y - elbow_y
    fore_x, fore_y = chord_x * rest_x + chord_y * rest_y, chord_y * rest_x - chord_x * rest_y
    wrist_x, wrist_y = elbow_x + shape.fore * fore_x, elbow_y + shape.fore * fore_y
    tip_x = wrist_x + shape.hand * (fore_x * cos_bend - fore_y * sin_bend)
    tip_y = wrist_y + shape.hand * (fore_y * cos_bend + fore_x * sin_bend)
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
class Arms:
    """Solved arms: `solved` (11, n) as `place` gives it. Angles in radians, places in arm lengths, y up."""

    solved: Array

    @property
    def azimuth(self) -> Array:
        """The plane's azimuth (n,), from z towards x."""
        azimuth: Array = np.arctan2(self.solved[0], self.solved[1])
        return azimuth

    @property
    def elbow(self) -> Array:
        """Elbows (n, 3)."""
        return self.solved[2:5].T

    @property
    def wrist(self) -> Array:
        """Wrists (n, 3)."""
        return self.solved[5:8].T

    @property
    def tip(self) -> Array:
        """Hand tips (n, 3)."""
        return self.solved[8:11].T

    def angles(self) -> tuple[Array, Array, Array]:
        """Angles t0, t1, t2 (n,) of the links in their plane, from the horizontal upwards, as `Arm.angles` has them."""
        elbow, wrist, tip = (
            self.solved[at] * self.solved[0] + self.solved[at + 2] * self.solved[1] + 1j * self.solved[at + 1]
            for at in (2, 5, 8)
        )
        fore = wrist - elbow
        # each turn by itself, none of them beyond half a turn, so that nothing wraps
        t0 = np.angle(tip) - np.angle(tip * elbow.conj())
        t1 = t0 + np.angle(fore * elbow.conj())
        t2 = t1 + np.angle((tip - wrist) * fore.conj())
        return t0, t1, t2


def solve(proportions: Proportions, table: Table, targets: Array) -> Arms:
    """The arms whose tips are at `targets` (n, 3), in arm lengths with y up.

    A target nearer than the inner radius or farther than the arm is brought to the limit with its direction kept; one
    at the shoulder itself counts as straight below. Straight above or below, the plane is the one that faces forwards.
    """
    targets = np.asarray(targets, dtype=np.float64)
    shape, nodes = shape_of(proportions), table.astype(np.float64).ravel()
    solved = np.empty((11, len(targets)))
    for start in range(0, len(targets), CHUNK):
        x, y, z = np.ascontiguousarray(targets[start : start + CHUNK].T)
        for row, values in zip(solved, place(shape, nodes, x, y, z), strict=True):
            row[start : start + CHUNK] = values
    return Arms(solved)
