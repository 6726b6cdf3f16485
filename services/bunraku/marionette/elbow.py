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

from math import asin, atan2, cos, exp, isnan, log, pi, sin, sqrt
from typing import NamedTuple

from bunraku.marionette import planar_arm as link
from bunraku.marionette import shoulder as limit
from bunraku.marionette import vector
from bunraku.marionette.arm import Arm
from bunraku.marionette.planar_arm import ArmGeometry
from bunraku.marionette.proportions import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD
from bunraku.marionette.shoulder import ShoulderLimit
from bunraku.marionette.vector import Vector
from bunraku.motion.rotation import Array

HALF_SWING_DISTANCE = 0.05
"""Distance from the vertical axis, in arm lengths, at which the plane is drawn half as fast as far away."""
SWING_HALF_LIFE_S = 0.080
"""Seconds in which the swing left to do halves, far from the axis."""
MAX_SWING_SPEED_RAD_S = 2.0 * pi
"""Radians per second that the plane swings at most."""
MAX_ELBOW_SPEED = 1.68
"""Arm lengths per second: what the hand's way and the change of bend leave of this is there for the swing."""
MAX_OFFSET_PER_SLACK = 2.4
"""Arm lengths that the elbow is off the chord at most, for each arm length that the tip is short of full stretch:
gravity alone would have it snap into the line with the last of them."""
MIN_SWING_SPEED = 0.1
"""Arm lengths per second that are there for the swing in any case."""
CAP_CLEARANCE_RAD = 1e-7
"""Radians that an upper arm keeps from where no shoulder goes."""
MAX_LIFT_SPEED = 1.2
"""Arm lengths per second that the elbow leaves or nears the chord beyond what the tip asks for."""


class ArmConfiguration(NamedTuple):
    """An arm's freedoms settled: where the `tip` is, in arm lengths (not where it was asked to be only while the
    shoulder's limit leaves no other way), the unit `normal` of the arm's plane, square to it, and the wrist's
    `bend`."""

    tip: Vector
    normal: Vector
    bend: float


ElbowState = tuple[Vector, Vector, float, Vector]
"""What an elbow goes on from: the unit direction of the tip; the unit normal of the plane, square to it; how far the
upper arm lies off the chord, radians; and where it was shown last, a unit vector, or zero."""


def vertical_normal(direction: Vector, up: Vector) -> Vector | None:
    """Normal of the vertical plane through the unit `direction`; None within 1e-9 of the axis.

    Turning about it by a positive angle raises the outer end: it is the axis of the elbow's bend.
    """
    normal = vector.cross(direction, up)
    size = vector.length(normal)
    return vector.scale(normal, 1.0 / size) if size > 1e-9 else None


def elevation(direction: Vector, up: Vector) -> float:
    """The angle of a unit vector above the horizontal, radians, -pi/2..pi/2."""
    return atan2(vector.dot(direction, up), vector.length(vector.reject_from(direction, up)))


class Elbow:
    """One arm's elbow, in the shoulder's frame so that a turning body carries it."""

    def __init__(self, arm: Arm, shoulder: ShoulderLimit) -> None:
        self._arm = arm
        self._shoulder = shoulder
        self._state: ElbowState | None = None

    def reset(self) -> None:
        """The next call of `begin` starts anew."""
        self._state = None

    @property
    def has_begun(self) -> bool:
        """Whether it has begun."""
        return self._state is not None

    def begin(self, direction: Vector, normal: Vector, lift: float) -> None:
        """Starts with the tip in the unit `direction`, the plane as near to `normal` as square to it allows, and the
        upper arm `lift` radians off the chord."""
        square = vector.unit(vector.reject_from(normal, direction), vector.any_perpendicular(direction))
        self._state = (direction, square, lift, (0.0, 0.0, 0.0))

    def step(self, direction: Vector, reach: float, up: Vector, seconds: float) -> ArmConfiguration:
        """The arm once the tip has come to the unit `direction` at `reach` arm lengths, `seconds` after the last.

        `up` is the world's up, a unit vector in the same frame.
        """
        if self._state is None:
            raise RuntimeError("an elbow follows once it has begun")
        arm = self._arm
        settled, self._state = step_elbow(
            arm.geometry, arm.bend_nodes, self._shoulder, self._state, direction, reach, up, seconds
        )
        return ArmConfiguration(*settled)


def step_elbow(
    geometry: ArmGeometry,
    bend_nodes: Array,
    shoulder: ShoulderLimit,
    state: ElbowState,
    direction: Vector,
    reach: float,
    up: Vector,
    seconds: float,
) -> tuple[tuple[Vector, Vector, float], ElbowState]:
    """The arm of these `links` and this table of `nodes` (64, 64), `seconds` after its `memory`, and what it remembers
    then; the rest as `Elbow.follow` has it."""
    last_direction, last_normal, last_lift, last_shown = state
    upper, inner = geometry[0], geometry[3]
    before = upper_arm(last_direction, last_normal, last_lift)
    turned = vector.rotate(vector.rotation_between(last_direction, direction), last_normal)
    normal = vector.unit(vector.reject_from(turned, direction), vector.any_perpendicular(direction))
    r = min(max(reach, inner), MAX_TIP_DISTANCE)
    low, high = link.bend_limits(geometry, r)
    wanted = link.lift_for_bend(geometry, r, link.gravity_bend(geometry, bend_nodes, r, elevation(direction, up)))
    # towards full stretch the lift ends anyhow: evenly, and not within the last frames
    wanted = min(wanted, MAX_OFFSET_PER_SLACK * (MAX_TIP_DISTANCE - r) / upper)
    most = MAX_LIFT_SPEED * seconds / upper
    lift = min(max(wanted, last_lift - most), last_lift + most)
    lift = min(max(lift, link.lift_for_bend(geometry, r, high)), link.lift_for_bend(geometry, r, low))
    moved = _angle_between(upper_arm(direction, normal, lift), before) * upper
    left = max(MAX_ELBOW_SPEED * seconds - moved, MIN_SWING_SPEED * seconds)
    normal = _swing_normal(direction, normal, up, r, upper * sin(lift), seconds, left)
    goes_on = lift
    turn = limit.min_allowed_turn(shoulder, direction, normal, lift)
    if isnan(turn):
        # no turn helps: more bend of the elbow may, and where it does not, a hand that is nearer
        away = limit.angle_to_allowed(shoulder, direction) + CAP_CLEARANCE_RAD
        if away > link.lift_for_bend(geometry, r, low):
            r = link.max_distance_for_lift(geometry, r, away)
            low, high = link.bend_limits(geometry, r)
        lift = min(max(lift, away), link.lift_for_bend(geometry, r, low))
        turn = limit.min_allowed_turn(shoulder, direction, normal, lift)
    allowed = not isnan(turn)
    if allowed and turn != 0.0:
        normal = _rotate_normal(direction, normal, turn)
    shown = upper_arm(direction, normal, lift)
    most = (moved + left) / upper
    if vector.dot(last_shown, last_shown) > 0.0 and (not allowed or _angle_between(shown, last_shown) > most):
        # the shoulder's limit leaves one way only, and it is a long one: the hand waits for the elbow; where it
        # leaves none, close to the shoulder, the elbow waits too
        shown = limit.step_toward(shoulder, last_shown, shown, most) if allowed else last_shown
        hanging = _reach_from_upper_arm(geometry, shown, vector.scale(direction, reach), normal)
    else:
        hanging = (vector.scale(direction, r), normal, link.bend_for_lift(geometry, r, lift, low, high))
    return hanging, (direction, normal, goes_on, shown)


def upper_arm(direction: Vector, normal: Vector, lift: float) -> Vector:
    """The unit vector from the shoulder to an elbow `lift` radians off the unit `direction` of the tip, below it in
    the plane of the unit `normal`."""
    down = vector.cross(direction, normal)
    return vector.add(vector.scale(direction, cos(lift)), vector.scale(down, sin(lift)))


def _swing_normal(
    direction: Vector, normal: Vector, up: Vector, r: float, radius: float, seconds: float, max_travel: float
) -> Vector:
    """The normal, swung about the chord towards the vertical plane's by as much as the elbow may move, `left` arm
    lengths on its circle of this `radius` about the chord."""
    wanted = vector.cross(direction, up)
    size = vector.length(wanted)
    if size <= 1e-9:
        return normal
    wanted = vector.scale(wanted, 1.0 / size)
    off = vector.length(vector.reject_from(direction, up)) * r
    pull = off * off / (off * off + HALF_SWING_DISTANCE * HALF_SWING_DISTANCE)
    swing = atan2(vector.dot(vector.cross(normal, wanted), direction), vector.dot(normal, wanted))
    most = min(MAX_SWING_SPEED_RAD_S * seconds, max_travel / max(radius, 1e-3))
    turn = min(max(swing * (1.0 - exp(-log(2.0) * seconds * pull / SWING_HALF_LIFE_S)), -most), most)
    return _rotate_normal(direction, normal, turn)


def _reach_from_upper_arm(
    geometry: ArmGeometry, upper_arm: Vector, target: Vector, normal: Vector
) -> tuple[Vector, Vector, float]:
    """What hangs from an upper arm that is on its way, forearm and hand as near to `target` as they come."""
    upper, fore, hand, _, _, _ = geometry
    elbow = vector.scale(upper_arm, upper)
    way = vector.subtract(target, elbow)
    shortest = sqrt(fore * fore + hand * hand + 2.0 * fore * hand * cos(MAX_WRIST_BEND_RAD))
    length = min(max(vector.length(way), shortest), fore + hand)
    # where forearm and hand are straight, the cosine has lost the digits that tell the bend
    cosine = (length * length - fore * fore - hand * hand) / (2.0 * fore * hand)
    bend = link.clamped_acos(cosine) if length < fore + hand else 0.0
    lean = atan2(hand * sin(bend), fore + hand * cos(bend))
    side = vector.reject_from(way, upper_arm)
    off = vector.unit(side, vector.cross(normal, upper_arm))
    angle = atan2(vector.dot(way, off), vector.dot(way, upper_arm))
    angle = min(max(angle, lean), min(MAX_ELBOW_BEND_RAD + lean, pi))
    along = vector.add(vector.scale(upper_arm, cos(angle)), vector.scale(off, sin(angle)))
    tip = vector.add(elbow, vector.scale(along, length))
    r = min(vector.length(tip), MAX_TIP_DISTANCE)
    direction = vector.unit(tip, upper_arm)
    low, high = link.bend_limits(geometry, r)
    down = vector.unit(vector.reject_from(upper_arm, direction), vector.cross(direction, normal))
    return (vector.scale(direction, r), vector.cross(down, direction), min(max(bend, low), high))


def lift_angle(elbow: Vector, direction: Vector) -> float:
    """How far an elbow (from the shoulder, any length) is off the unit `direction` of the tip, radians."""
    along = vector.dot(elbow, direction)
    return atan2(sqrt(max(vector.dot(elbow, elbow) - along * along, 0.0)), along)


def _rotate_normal(direction: Vector, normal: Vector, angle: float) -> Vector:
    side = vector.cross(direction, normal)
    turned = vector.add(vector.scale(normal, cos(angle)), vector.scale(side, sin(angle)))
    return vector.scale(turned, 1.0 / vector.length(turned))


def _angle_between(a: Vector, b: Vector) -> float:
    """The angle between two unit vectors, radians; by the half chord, as the arc cosine loses small angles."""
    return 2.0 * asin(min(0.5 * vector.length(vector.subtract(a, b)), 1.0))
