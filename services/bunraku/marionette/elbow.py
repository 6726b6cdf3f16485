"""Where the elbow goes: where gravity wants it, at a bounded speed, and never where no shoulder lets it.

With the hand tip given, an arm is still free in two ways: it turns about the chord, the line from shoulder to tip, and
it trades the wrist's bend for the elbow's, which lifts the upper arm off the chord more or less. Gravity alone would
put it into the vertical plane with the bend of least energy. That plane is undefined straight above and below the
shoulder, so a hand that passes there would throw the elbow across; and an arm that leaves its full stretch would snap
its elbow out. So both are remembered: the plane is carried along with the hand by the shortest turn and swings towards
the vertical one, the faster the farther the hand is from the axis, and the lift follows gravity's. The tip is exact at
every instant, as only the two freedoms are slowed down, never the hand.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

from bunraku.marionette import vector
from bunraku.marionette.arm import Arm
from bunraku.marionette.proportions import ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT
from bunraku.marionette.shoulder import Shoulder
from bunraku.marionette.vector import Vector

NEAR_AXIS = 0.05
"""Distance from the vertical axis, in arm lengths, at which the plane is drawn half as fast as far away."""
HALF_LIFE = 0.080
"""Seconds in which the swing left to do halves, far from the axis."""
FASTEST = 2.0 * pi
"""Radians per second that the plane swings at most."""
SPEED = 1.68
"""Arm lengths per second: what the hand's way and the change of bend leave of this is there for the swing."""
SLOPE = 2.4
"""Arm lengths that the elbow is off the chord at most, for each arm length that the tip is short of full stretch:
gravity alone would have it snap into the line with the last of them."""
LEAST_SPEED = 0.1
"""Arm lengths per second that are there for the swing in any case."""
CLEAR = 1e-7
"""Radians that an upper arm keeps from where no shoulder goes."""
LIFT_SPEED = 1.2
"""Arm lengths per second that the elbow leaves or nears the chord beyond what the tip asks for."""


class Hanging(NamedTuple):
    """An arm's freedoms settled: where the `tip` is, in arm lengths (not where it was asked to be only while the
    shoulder's limit leaves no other way), the unit `normal` of the arm's plane, square to it, and the wrist's
    `bend`."""

    tip: Vector
    normal: Vector
    bend: float


def vertical_normal(direction: Vector, up: Vector) -> Vector | None:
    """Normal of the vertical plane through the unit `direction`; None within 1e-9 of the axis.

    Turning about it by a positive angle raises the outer end: it is the axis of the elbow's bend.
    """
    normal = vector.cross(direction, up)
    size = vector.length(normal)
    return vector.scale(normal, 1.0 / size) if size > 1e-9 else None


def elevation(direction: Vector, up: Vector) -> float:
    """The angle of a unit vector above the horizontal, radians, -pi/2..pi/2."""
    return atan2(vector.dot(direction, up), vector.length(vector.square_to(direction, up)))


class Elbow:
    """One arm's elbow, in the shoulder's frame so that a turning body carries it."""

    def __init__(self, arm: Arm, shoulder: Shoulder) -> None:
        self._arm = arm
        self._shoulder = shoulder
        self._upper = arm.proportions.lengths[0]
        self._direction: Vector | None = None
        self._normal: Vector = (1.0, 0.0, 0.0)
        self._lift = 0.0
        # where the upper arm was shown last
        self._was: Vector | None = None

    def forget(self) -> None:
        """The next call of `begin` starts anew."""
        self._direction = self._was = None

    @property
    def known(self) -> bool:
        """Whether it has begun."""
        return self._direction is not None

    def begin(self, direction: Vector, normal: Vector, lift: float) -> None:
        """Starts with the tip in the unit `direction`, the plane as near to `normal` as square to it allows, and the
        upper arm `lift` radians off the chord."""
        self._direction = direction
        self._normal = vector.unit(vector.square_to(normal, direction), vector.across(direction))
        self._lift = lift

    def follow(self, direction: Vector, reach: float, up: Vector, seconds: float) -> Hanging:
        """The arm once the tip has come to the unit `direction` at `reach` arm lengths, `seconds` after the last.

        `up` is the world's up, a unit vector in the same frame.
        """
        before = self._upper_arm(self._direction or direction, self._normal, self._lift)
        normal = self._carry(direction)
        r = self._arm.clamp(reach)
        low, high = self._arm.limits(r)
        least, greatest = self._lift_of(r, high), self._lift_of(r, low)
        wanted = self._lift_of(r, self._arm.bend(r, elevation(direction, up)))
        # towards full stretch the lift ends anyhow: evenly, and not within the last frames
        wanted = min(wanted, SLOPE * (OUTER_RADIUS - r) / self._upper)
        most = LIFT_SPEED * seconds / self._upper
        lift = min(max(wanted, self._lift - most), self._lift + most)
        lift = min(max(lift, least), greatest)
        moved = _apart(self._upper_arm(direction, normal, lift), before) * self._upper
        left = max(SPEED * seconds - moved, LEAST_SPEED * seconds)
        normal = self._swing(direction, normal, up, r, lift, seconds, left)
        self._lift = lift
        r, normal, lift, low, high, allowed = self._shoulder_allows(direction, normal, r, lift, low, high)
        self._direction, self._normal = direction, normal
        was, self._was = self._was, self._upper_arm(direction, normal, lift)
        most = (moved + left) / self._upper
        if was is not None and (not allowed or _apart(self._was, was) > most):
            # the shoulder's limit leaves one way only, and it is a long one: the hand waits for the elbow; where it
            # leaves none, close to the shoulder, the elbow waits too
            self._was = self._shoulder.toward(was, self._was, most) if allowed else was
            return self._reach_out(self._was, vector.scale(direction, reach), normal)
        return Hanging(vector.scale(direction, r), normal, self._bend_of(r, lift, low, high))

    def _upper_arm(self, direction: Vector, normal: Vector, lift: float) -> Vector:
        """The unit vector from the shoulder to the elbow."""
        down = vector.cross(direction, normal)
        return vector.add(vector.scale(direction, cos(lift)), vector.scale(down, sin(lift)))

    def _carry(self, direction: Vector) -> Vector:
        if self._direction is None:
            raise RuntimeError("an elbow follows once it has begun")
        turned = vector.rotate(vector.between(self._direction, direction), self._normal)
        return vector.unit(vector.square_to(turned, direction), vector.across(direction))

    def _swing(
        self, direction: Vector, normal: Vector, up: Vector, r: float, lift: float, seconds: float, left: float
    ) -> Vector:
        """The normal, swung about the chord towards the vertical plane's by as much as the elbow may move."""
        wanted = vertical_normal(direction, up)
        if wanted is None:
            return normal
        off = vector.length(vector.square_to(direction, up)) * r
        pull = off * off / (off * off + NEAR_AXIS * NEAR_AXIS)
        swing = atan2(vector.dot(vector.cross(normal, wanted), direction), vector.dot(normal, wanted))
        most = min(FASTEST * seconds, left / max(self._upper * sin(lift), 1e-3))
        turn = min(max(swing * (1.0 - 2.0 ** (-seconds * pull / HALF_LIFE)), -most), most)
        return _turned(direction, normal, turn)

    def _shoulder_allows(
        self, direction: Vector, normal: Vector, r: float, lift: float, low: float, high: float
    ) -> tuple[float, Vector, float, float, float, bool]:
        """Distance, normal, lift, and least and greatest wrist bend nearest to these that the shoulder lets be, and
        whether it lets any."""
        turn: float | None = self._shoulder.turn(direction, normal, lift)
        if turn == 0.0:
            return r, normal, lift, low, high, True
        if turn is None:
            # no turn helps: more bend of the elbow may, and where it does not, a hand that is nearer
            away = self._shoulder.away(direction) + CLEAR
            if away > self._lift_of(r, low):
                r = self._nearer(r, away)
                low, high = self._arm.limits(r)
            lift = min(max(lift, away), self._lift_of(r, low))
            turn = self._shoulder.turn(direction, normal, lift)
        return r, _turned(direction, normal, turn or 0.0), lift, low, high, turn is not None

    def _reach_out(self, upper_arm: Vector, target: Vector, normal: Vector) -> Hanging:
        """What hangs from an upper arm that is on its way, forearm and hand as near to `target` as they come."""
        upper, fore, hand = self._arm.proportions.lengths
        elbow = vector.scale(upper_arm, upper)
        way = vector.subtract(target, elbow)
        shortest = sqrt(fore * fore + hand * hand + 2.0 * fore * hand * cos(WRIST_LIMIT))
        length = min(max(vector.length(way), shortest), fore + hand)
        # where forearm and hand are straight, the cosine has lost the digits that tell the bend
        cosine = (length * length - fore * fore - hand * hand) / (2.0 * fore * hand)
        bend = acos(min(max(cosine, -1.0), 1.0)) if length < fore + hand else 0.0
        lean = atan2(hand * sin(bend), fore + hand * cos(bend))
        side = vector.square_to(way, upper_arm)
        off = vector.unit(side, vector.cross(normal, upper_arm))
        angle = atan2(vector.dot(way, off), vector.dot(way, upper_arm))
        angle = min(max(angle, lean), min(ELBOW_LIMIT + lean, pi))
        along = vector.add(vector.scale(upper_arm, cos(angle)), vector.scale(off, sin(angle)))
        tip = vector.add(elbow, vector.scale(along, length))
        r = min(vector.length(tip), OUTER_RADIUS)
        direction = vector.unit(tip, upper_arm)
        low, high = self._arm.limits(r)
        down = vector.unit(vector.square_to(upper_arm, direction), vector.cross(direction, normal))
        return Hanging(vector.scale(direction, r), vector.cross(down, direction), min(max(bend, low), high))

    def _nearer(self, r: float, away: float) -> float:
        """The farthest tip, no farther than `r`, whose upper arm is lifted `away` radians off the chord."""
        near, far = self._arm.inner, r
        for _ in range(40):
            middle = 0.5 * (near + far)
            near, far = (middle, far) if self._lift_of(middle, self._arm.limits(middle)[0]) >= away else (near, middle)
        return near

    def _lift_of(self, r: float, bend: float) -> float:
        upper, fore, hand = self._arm.proportions.lengths
        square = fore * fore + hand * hand + 2.0 * fore * hand * cos(bend)
        return acos(min(max((upper * upper + r * r - square) / (2.0 * upper * r), -1.0), 1.0))

    def _bend_of(self, r: float, lift: float, low: float, high: float) -> float:
        upper, fore, hand = self._arm.proportions.lengths
        # at a limit the cosine has lost the digits that tell the bend
        if lift >= self._lift_of(r, low):
            return low
        square = upper * upper + r * r - 2.0 * upper * r * cos(lift)
        bend = acos(min(max((square - fore * fore - hand * hand) / (2.0 * fore * hand), -1.0), 1.0))
        return min(max(bend, low), high)


def lift_between(elbow: Vector, direction: Vector) -> float:
    """How far an elbow (from the shoulder, any length) is off the unit `direction` of the tip, radians."""
    along = vector.dot(elbow, direction)
    return atan2(sqrt(max(vector.dot(elbow, elbow) - along * along, 0.0)), along)


def _turned(direction: Vector, normal: Vector, turn: float) -> Vector:
    side = vector.cross(direction, normal)
    turned = vector.add(vector.scale(normal, cos(turn)), vector.scale(side, sin(turn)))
    return vector.scale(turned, 1.0 / hypot(*turned))


def _apart(a: Vector, b: Vector) -> float:
    """The angle between two unit vectors, radians; by the half chord, as the arc cosine loses small angles."""
    return 2.0 * asin(min(0.5 * vector.length(vector.subtract(a, b)), 1.0))
