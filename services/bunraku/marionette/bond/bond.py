"""Bond of two hands: their tips stay together, whoever moves them (proto/control.md, 5.10).

The pair is one point that follows the mean of both hands' goals at a bounded acceleration, within the common reach. The
mean is weighted by how recently each goal was set. The point is carried along by the shoulders with the same weights,
as a single hand is by its shoulder. A bond begins with the hands apart: each has an offset from the point, which
is reduced to zero.

Positions and velocities are in the world, in metres, unless stated otherwise.
"""

from __future__ import annotations

from math import exp2, inf
from typing import NamedTuple

from bunraku.marionette.bond.carrier import Carrier, Shoulder
from bunraku.marionette.bond.common_reach import Shell, ShellBorder, nearest_common_point
from bunraku.marionette.bond.steering import braking_speed, keep_within, limit_change, steer, wall_before
from bunraku.marionette.constants import (
    BOND_BEGIN_ACCELERATION,
    BOND_BORDER_MARGIN,
    BOND_JOIN_ACCELERATION,
    HAND_ACCELERATION,
    MAX_BOND_BEGIN_SPEED,
    MAX_BOND_STRETCH,
    MAX_LIMB_SPEED,
    MAX_REACH,
    MAX_TARGET_SPEED,
    MAX_TIP_DISTANCE,
    MIN_REACH,
    RECENCY_HALF_LIFE_S,
    SHARE_HALF_LIFE_S,
)
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.follower_step import path_to
from bunraku.marionette.solver.vector import ZERO, Vector

JOINED_DISTANCE_M = 1e-9
"""Distance and speed below which a hand counts as joined to the pair."""


class BondedHand(NamedTuple):
    """One hand of a bond in one frame."""

    shoulder: Shoulder
    goal: Vector | None
    """Place that its puppeteer asks for, None for a hand that is led."""


HandPair = tuple[BondedHand, BondedHand]


State = tuple[Vector, Vector]
"""Position and velocity in the carried frame."""


class HandMotion(NamedTuple):
    """Place and velocity of a hand in its shoulder's frame, arm lengths and arm lengths per second."""

    place: Vector
    velocity: Vector


def recency_share(first_age_s: float, second_age_s: float) -> float:
    """Return the share (0..1) of the first of two goals that were set these times ago; infinity for never."""
    if first_age_s == inf or second_age_s == inf:
        return 0.5 if first_age_s == second_age_s else float(second_age_s == inf)
    halvings = (first_age_s - second_age_s) / RECENCY_HALF_LIFE_S
    return 1.0 / (1.0 + exp2(min(max(halvings, -60.0), 60.0)))


def is_in_reach(first: Shoulder, second: Shoulder) -> bool:
    """Return whether two hands can be bonded: their shoulders are no further apart than both arms reach."""
    distance = vector.length(vector.subtract(second.position, first.position))
    shells = _shell(first), _shell(second)
    within = MAX_BOND_STRETCH * (shells[0].outer + shells[1].outer)
    return distance <= within and nearest_common_point(first.position, *shells) is not None


class Bond:
    """State of one bond, from its first frame on."""

    def __init__(self, hands: HandPair, motions: tuple[HandMotion, HandMotion], share: float) -> None:
        """Begin with the hands where they are; `share` (0..1) is the weight of the first one's goal."""
        self.share = share
        self.is_limited = False
        """True if a shoulder's limit keeps the pair from where it would be."""
        shoulders = (hands[0].shoulder, hands[1].shoulder)
        self._shoulders = shoulders
        unit_m = min(shoulder.arm_length_m for shoulder in shoulders)
        positions = [shoulder.to_world(motion.place) for shoulder, motion in zip(shoulders, motions, strict=True)]
        self._own_velocities: list[Vector] | None = [
            vector.scale(vector.rotate(shoulder.rotation, motion.velocity), shoulder.arm_length_m)
            for shoulder, motion in zip(shoulders, motions, strict=True)
        ]
        middle = self._mean(positions[0], positions[1])
        reach = [_shell(shoulder) for shoulder in shoulders]
        self._point = nearest_common_point(middle, reach[0], reach[1]) or middle
        self._velocity = ZERO
        self._spread = ZERO
        """Spread of both shoulders' frames at the pair, in the last frame."""
        self._offsets = [vector.subtract(position, self._point) for position in positions]
        self._offset_velocities = [ZERO, ZERO]
        self._goal: Vector | None = None
        self._unit_m = unit_m

    @property
    def positions(self) -> tuple[Vector, Vector]:
        """Positions of both hands."""
        first, second = self._offsets
        return vector.add(self._point, first), vector.add(self._point, second)

    @property
    def is_joined(self) -> bool:
        """True if both hands have met."""
        return self._own_velocities is None and not any(
            offset != ZERO for offset in (*self._offsets, *self._offset_velocities)
        )

    def step(self, hands: HandPair, share: float, seconds: float) -> bool:
        """Move the pair for `seconds`; return False, without effect, if the arms have no point in common.

        `share` is the present `recency_share`, which the weight of the first goal approaches. At least one hand has a
        goal.
        """
        shoulders = (hands[0].shoulder, hands[1].shoulder)
        shells = (_shell(shoulders[0]), _shell(shoulders[1]))
        new_share = share + (self.share - share) * exp2(-seconds / SHARE_HALF_LIFE_S)
        goal = nearest_common_point(self._requested_point(hands, new_share), *shells)
        if goal is None:
            return False
        if seconds <= 0.0:
            return True
        carrier = Carrier(self._shoulders, shoulders, new_share)
        # the same velocity, seen from the frame that is carried with the new weights
        self._velocity = vector.add(self._velocity, vector.scale(self._spread, self.share - new_share))
        self._spread = carrier.spread(self._point, seconds)
        self.share = new_share
        if self._own_velocities is not None:
            self._begin_moving(self._own_velocities, shells, carrier, seconds)
            self._own_velocities = None
        self._shoulders = shoulders
        self._unit_m = min(shoulder.arm_length_m for shoulder in shoulders)
        start = carrier.move(self._point), vector.rotate(carrier.rotation, self._velocity)
        self._move_point(goal, start, shells, carrier, seconds)
        self._goal = goal
        for side in (0, 1):
            self._reduce_offset(side, start, carrier, seconds)
        return True

    def stay_at(self, position: Vector) -> None:
        """Move the joined pair to a position next to its own, where the shoulders' limits keep it."""
        self.is_limited = position != self._point
        if position != self._point:
            moved = vector.subtract(position, self._point)
            self._point = position
            back = vector.unit(moved, ZERO)
            self._velocity = vector.subtract(
                self._velocity, vector.scale(back, min(vector.dot(self._velocity, back), 0.0))
            )

    def _requested_point(self, hands: HandPair, share: float) -> Vector:
        """Return the mean of the goals, or the only one."""
        first, second = (hand.shoulder.to_world(hand.goal) if hand.goal is not None else None for hand in hands)
        if first is None or second is None:
            only = second if first is None else first
            if only is None:
                raise ValueError("a bond needs the goal of at least one hand")
            return only
        return vector.add(vector.scale(first, share), vector.scale(second, 1.0 - share))

    def _mean(self, first: Vector, second: Vector) -> Vector:
        return vector.add(vector.scale(first, self.share), vector.scale(second, 1.0 - self.share))

    def _begin_moving(
        self, own_velocities: list[Vector], shells: tuple[Shell, Shell], carrier: Carrier, seconds: float
    ) -> None:
        """Set the velocities in the carried frame from those relative to each hand's own shoulder.

        The point takes what can stop within the common reach, the offsets take the rest.
        """
        positions = self.positions
        velocities = [vector.add(own_velocities[side], carrier.slip(side, positions[side], seconds)) for side in (0, 1)]
        mean = vector.rotate(carrier.rotation, self._mean(velocities[0], velocities[1]))
        max_change = 0.5 * HAND_ACCELERATION * self._unit_m * seconds
        gaps = carrier.border(shells, seconds).gaps(carrier.move(self._point))
        allowed = keep_within(mean, [wall_before(gap, max_change, seconds) for gap in gaps])
        allowed = limit_change(ZERO, allowed, MAX_BOND_BEGIN_SPEED * self._unit_m)
        self._velocity = vector.rotate(vector.conjugate(carrier.rotation), allowed)
        self._offset_velocities = [vector.subtract(velocity, self._velocity) for velocity in velocities]

    def _move_point(
        self, goal: Vector, begin: State, shells: tuple[Shell, Shell], carrier: Carrier, seconds: float
    ) -> None:
        """Move the point towards `goal` from its state `begin` in the frame that the shoulders carry."""
        start, before = begin
        max_change = HAND_ACCELERATION * self._unit_m * seconds
        free_change = max_change if self.is_joined else BOND_BEGIN_ACCELERATION * self._unit_m * seconds
        goal_velocity = ZERO
        if self._goal is not None:
            moved = vector.scale(vector.subtract(goal, carrier.move(self._goal)), 1.0 / seconds)
            if vector.length(moved) <= MAX_TARGET_SPEED * self._unit_m:
                goal_velocity = moved
        aim = self._aim(start, goal, goal_velocity, shells, free_change, seconds)
        velocity = steer(start, before, aim, carrier.border(shells, seconds), max_change, seconds, free_change)
        after = vector.add(start, vector.scale(velocity, seconds))
        reach = (_shell(self._shoulders[0], 0.0), _shell(self._shoulders[1], 0.0))
        self._point = nearest_common_point(after, *reach) or after
        self._velocity = vector.scale(vector.subtract(self._point, start), 1.0 / seconds)

    def _aim(
        self,
        start: Vector,
        goal: Vector,
        goal_velocity: Vector,
        shells: tuple[Shell, Shell],
        max_change: float,
        seconds: float,
    ) -> Vector:
        """Return the velocity to aim at, as for a single hand; the path keeps clear of both shoulders."""
        target = vector.subtract(goal, vector.scale(goal_velocity, seconds))
        direction, distance = ZERO, -1.0
        for shell in shells:
            way, length = path_to(
                vector.scale(vector.subtract(start, shell.centre), 1.0 / self._unit_m),
                vector.scale(vector.subtract(target, shell.centre), 1.0 / self._unit_m),
                shell.inner / self._unit_m,
            )
            if length > distance:
                direction, distance = way, length
        distance *= self._unit_m
        speed = min(braking_speed(distance, max_change, seconds), MAX_LIMB_SPEED * self._unit_m)
        return vector.add(goal_velocity, vector.scale(direction, speed))

    def _reduce_offset(self, side: int, begin: State, carrier: Carrier, seconds: float) -> None:
        """Reduce the offset of one hand within the reach of its arm; the point was in the state `begin`."""
        if self._offsets[side] == ZERO and self._offset_velocities[side] == ZERO:
            return
        away = vector.rotate(carrier.rotation, self._offsets[side])
        offset_before = vector.rotate(carrier.rotation, self._offset_velocities[side])
        start, before = vector.add(begin[0], away), vector.add(begin[1], offset_before)
        join_change = BOND_JOIN_ACCELERATION * self._unit_m * seconds
        speed = min(braking_speed(vector.length(away), join_change, seconds), MAX_LIMB_SPEED * self._unit_m)
        join = limit_change(offset_before, vector.scale(vector.unit(away, ZERO), -speed), join_change)
        shoulder = self._shoulders[side]
        scale = shoulder.arm_length_m
        shell = Shell(shoulder.position, shoulder.min_tip_distance * scale, MAX_TIP_DISTANCE * scale)
        border = ShellBorder(shell, carrier.drift(side, seconds))
        max_change = HAND_ACCELERATION * self._unit_m * seconds
        velocity = steer(start, before, vector.add(self._velocity, join), border, max_change, seconds)
        reached = shell.nearest(vector.add(start, vector.scale(velocity, seconds)))
        moved = vector.scale(vector.subtract(reached, start), 1.0 / seconds)
        offset = vector.subtract(reached, self._point)
        velocity = vector.subtract(moved, self._velocity)
        if vector.length(offset) < JOINED_DISTANCE_M:
            offset = ZERO
            if vector.length(velocity) < JOINED_DISTANCE_M:
                velocity = ZERO
        self._offsets[side], self._offset_velocities[side] = offset, velocity


def _shell(shoulder: Shoulder, margin: float = BOND_BORDER_MARGIN) -> Shell:
    """Return the reach of an arm for a bond; `margin` is in arm lengths."""
    scale = shoulder.arm_length_m
    inner = max(MIN_REACH, shoulder.min_tip_distance) + margin
    return Shell(shoulder.position, inner * scale, (MAX_REACH - margin) * scale)
