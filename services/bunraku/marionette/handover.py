"""Between the dance and a puppeteer's hand: what keeps a limb from jumping when it is taken and let go.

The *target* is blended, then the limb is solved. Over the same time `blend` brings the joints from the dance's way of
reaching a place to the marionette's.
"""

from __future__ import annotations

from math import acos, asin, cos, pi

from bunraku.marionette import vector
from bunraku.marionette.arm import Arm
from bunraku.marionette.limbs import Joints
from bunraku.marionette.vector import Quaternion, Vector

TAKE = 0.150
"""Seconds from the dance to a puppeteer's hand."""
GIVE_BACK = 0.300
"""Seconds from a puppeteer's hand to the dance."""
TURN_SPEED = 3.0 * pi
"""Radians per second that a hand goes round the shoulder at most, however its target jumps."""
FOLD_SPEED = 2.0 * pi
"""Radians per second that the arm folds and unfolds at most: the change of a where the hand is at cos a arm lengths,
which is about half the elbow's bend. (A bound on the distance would let a nearly straight elbow snap.)"""
THIGH_SPEED = 12.0
"""Radians per second that a thigh is swung at most."""


def minimum_jerk(x: float) -> float:
    """0 to 1 for x from 0 to 1, with no speed and no acceleration at either end (Flash and Hogan 1985)."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


class Handover:
    """How far a limb is in its puppeteer's hands: `progress` 0 (the dance's) to 1, even in time."""

    def __init__(self) -> None:
        self.progress = 0.0

    @property
    def weight(self) -> float:
        """Of the puppeteer's target, 0..1."""
        return minimum_jerk(self.progress)

    def advance(self, held: bool, seconds: float) -> None:
        """`seconds` later, with the limb held or not."""
        step = seconds / TAKE if held else -seconds / GIVE_BACK
        self.progress = min(max(self.progress + step, 0.0), 1.0)


def follow_hand(hand: Vector, target: Vector, arm: Arm, seconds: float) -> Vector:
    """The hand on its way round the shoulder to `target`: at `TURN_SPEED` and `FOLD_SPEED` at most, and always at a
    distance the arm is solved for (all in arm lengths)."""
    down = (0.0, -1.0, 0.0)
    here, there = vector.unit(hand, down), vector.unit(target, down)
    fold, wanted = acos(arm.clamp(vector.length(hand))), acos(arm.clamp(vector.length(target)))
    angle = _angle(here, there)
    most = TURN_SPEED * seconds
    direction = there if angle <= most else _toward(here, there, angle, most / angle)
    return vector.scale(direction, cos(fold + _limited(wanted - fold, FOLD_SPEED * seconds)))


def follow_thigh(theta: float, target: float, seconds: float) -> float:
    """The thigh on its way to `target`, radians, at `THIGH_SPEED` at most."""
    return theta + _limited(target - theta, THIGH_SPEED * seconds)


class HandMix:
    """The target between the dance's hand and the pulled one, on a way round the shoulder and not through it.

    The way is a turn that brings one direction to the other. It is carried on from call to call, so that two hands that
    pass opposite each other do not make it change sides.
    """

    def __init__(self) -> None:
        self._turn: Quaternion | None = None

    def mix(self, dance: Vector, pulled: Vector, weight: float) -> tuple[Vector, Quaternion]:
        """The target at `weight`, exactly either hand at 0 and 1, and the turn from the dance's direction to it."""
        down = (0.0, -1.0, 0.0)
        here, there = vector.unit(dance, down), vector.unit(pulled, down)
        if self._turn is None:
            turn = vector.between(here, there)
        else:
            turn = vector.multiply(vector.between(vector.rotate(self._turn, here), there), self._turn)
        if weight >= 1.0:
            # all the way there any turn will do: start afresh from the shortest
            self._turn = None
            return pulled, turn
        self._turn = vector.normalise(turn)
        part = vector.part_of(self._turn, max(weight, 0.0))
        if weight <= 0.0:
            return dance, part
        reach = (1.0 - weight) * vector.length(dance) + weight * vector.length(pulled)
        return vector.scale(vector.rotate(part, here), reach), part


def mix_joints(dance: Joints, hung: Joints, weight: float) -> Joints:
    """The joints between; exactly either at weight 0 and 1."""
    if weight <= 0.0 or weight >= 1.0:
        return hung if weight >= 1.0 else dance
    a, b, c = (vector.slerp(one, other, weight) for one, other in zip(dance, hung, strict=True))
    return (a, b, c)


def _angle(a: Vector, b: Vector) -> float:
    # by the half chord: the arc cosine alone loses small angles
    half = 0.5 * vector.length(vector.subtract(a, b))
    return 2.0 * asin(min(half, 1.0))


def _toward(a: Vector, b: Vector, angle: float, share: float) -> Vector:
    """The unit vector on the great circle from `a` to `b`, `angle` apart, at a share of the way."""
    axis = vector.unit(vector.cross(a, b), vector.across(a))
    return vector.rotate(vector.about(axis, angle * share), a)


def _limited(step: float, most: float) -> float:
    return min(max(step, -most), most)
