"""One time step of the elbow: where gravity puts it, at a bounded speed, within the shoulder's limit.

With the hand tip given, an arm has two freedoms. It turns about the chord, the segment from shoulder to tip. And it
trades the bend of the wrist for the bend of the elbow, which lifts the upper arm off the chord. Gravity alone would
put the arm into the vertical plane with the bend of least energy. That plane is undefined straight above and below the
shoulder, so a hand that passes there would throw the elbow across; and an arm that leaves full stretch would snap its
elbow out. So both freedoms have a state: the plane is carried along with the hand by the shortest rotation and swings
towards the vertical plane, the faster the farther the hand is from the axis, and the lift follows gravity's. The tip
is exact at every instant, because only the two freedoms are slowed down, never the hand.

Plain functions of plain numbers, so that `_kernels` can compile them.
"""

from __future__ import annotations

from math import asin, atan2, cos, exp, isnan, log, pi, sin, sqrt
from typing import NamedTuple

from bunraku.marionette.constants import (
    CAP_CLEARANCE_RAD,
    HALF_SWING_DISTANCE,
    MAX_ELBOW_BEND_RAD,
    MAX_ELBOW_SPEED,
    MAX_LIFT_SPEED,
    MAX_OFFSET_PER_SLACK,
    MAX_SWING_SPEED_RAD_S,
    MAX_TIP_DISTANCE,
    MAX_WRIST_BEND_RAD,
    MIN_SWING_SPEED,
    SWING_HALF_LIFE_S,
)
from bunraku.marionette.solver import planar_arm as link
from bunraku.marionette.solver import shoulder as limit
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.planar_arm import ArmGeometry
from bunraku.marionette.solver.shoulder import ShoulderLimit
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.rotation import Array


class ArmConfiguration(NamedTuple):
    """Solved arm.

    `tip` is the position of the hand tip in arm lengths; it differs from the target only while the shoulder's limit
    leaves no other way. `normal` is the unit normal of the arm's plane, perpendicular to the tip. `bend` is the bend of
    the wrist in radians.
    """

    tip: Vector
    normal: Vector
    bend: float


ElbowState = tuple[Vector, Vector, float, Vector]
"""State of an elbow between two steps.

The unit direction of the tip; the unit normal of the plane, perpendicular to it; the angle of the upper arm off the
chord, radians; the shown unit direction of the upper arm, or zero before the first step.
"""


def vertical_normal(direction: Vector, up: Vector) -> Vector | None:
    """Return the normal of the vertical plane through the unit `direction`; None within 1e-9 of the axis.

    A positive rotation about it raises the outer end: it is the axis of the elbow's bend.
    """
    normal = vector.cross(direction, up)
    size = vector.length(normal)
    return vector.scale(normal, 1.0 / size) if size > 1e-9 else None


def elevation(direction: Vector, up: Vector) -> float:
    """Return the angle of a unit vector above the horizontal, radians, -pi/2..pi/2."""
    return atan2(vector.dot(direction, up), vector.length(vector.reject_from(direction, up)))


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
    """Return tip, normal and bend of the arm `seconds` after `state`, and the new state.

    `bend_nodes` (64, 64) is the arm's bend table. The tip is to be in the unit `direction` at `reach` arm lengths; `up`
    is the world's up in the same frame.
    """
    last_direction, last_normal, last_lift, last_shown = state
    upper, inner = geometry[0], geometry[3]
    previous = upper_arm(last_direction, last_normal, last_lift)
    carried = vector.rotate(vector.rotation_between(last_direction, direction), last_normal)
    normal = vector.unit(vector.reject_from(carried, direction), vector.any_perpendicular(direction))
    r = min(max(reach, inner), MAX_TIP_DISTANCE)
    low, high = link.bend_limits(geometry, r)
    goal = link.lift_for_bend(geometry, r, link.gravity_bend(geometry, bend_nodes, r, elevation(direction, up)))
    # the lift vanishes at full stretch: reduce it evenly, not within the last frames
    goal = min(goal, MAX_OFFSET_PER_SLACK * (MAX_TIP_DISTANCE - r) / upper)
    max_change = MAX_LIFT_SPEED * seconds / upper
    lift = min(max(goal, last_lift - max_change), last_lift + max_change)
    lift = min(max(lift, link.lift_for_bend(geometry, r, high)), link.lift_for_bend(geometry, r, low))
    moved = _angle_between(upper_arm(direction, normal, lift), previous) * upper
    travel = max(MAX_ELBOW_SPEED * seconds - moved, MIN_SWING_SPEED * seconds)
    normal = _swing_normal(direction, normal, up, r, upper * sin(lift), seconds, travel)
    next_lift = lift
    turn = limit.min_allowed_turn(shoulder, direction, normal, lift)
    if isnan(turn):
        # no turn helps: bend the elbow more, and if that does not help, bring the hand nearer
        min_lift = limit.angle_to_allowed(shoulder, direction) + CAP_CLEARANCE_RAD
        if min_lift > link.lift_for_bend(geometry, r, low):
            r = link.max_distance_for_lift(geometry, r, min_lift)
            low, high = link.bend_limits(geometry, r)
        lift = min(max(lift, min_lift), link.lift_for_bend(geometry, r, low))
        turn = limit.min_allowed_turn(shoulder, direction, normal, lift)
    is_allowed = not isnan(turn)
    if is_allowed and turn != 0.0:
        normal = _rotate_normal(direction, normal, turn)
    shown = upper_arm(direction, normal, lift)
    max_angle = (moved + travel) / upper
    if vector.dot(last_shown, last_shown) > 0.0 and (not is_allowed or _angle_between(shown, last_shown) > max_angle):
        # the shoulder's limit leaves only a long way: the hand waits for the elbow; close to the shoulder, where the
        # limit leaves no way, the elbow waits too
        shown = limit.step_toward(shoulder, last_shown, shown, max_angle) if is_allowed else last_shown
        configuration = _reach_from_upper_arm(geometry, shown, vector.scale(direction, reach), normal)
    else:
        configuration = (vector.scale(direction, r), normal, link.bend_for_lift(geometry, r, lift, low, high))
    return configuration, (direction, normal, next_lift, shown)


def upper_arm(direction: Vector, normal: Vector, lift: float) -> Vector:
    """Return the unit vector from the shoulder to an elbow `lift` radians below the chord.

    The chord is the unit `direction` of the tip; the elbow lies in the plane of the unit `normal`.
    """
    down = vector.cross(direction, normal)
    return vector.add(vector.scale(direction, cos(lift)), vector.scale(down, sin(lift)))


def _swing_normal(
    direction: Vector, normal: Vector, up: Vector, r: float, radius: float, seconds: float, max_travel: float
) -> Vector:
    """Return the normal, swung about the chord towards the normal of the vertical plane.

    The elbow moves by at most `max_travel` arm lengths on its circle of this `radius` about the chord.
    """
    vertical = vector.cross(direction, up)
    size = vector.length(vertical)
    if size <= 1e-9:
        return normal
    vertical = vector.scale(vertical, 1.0 / size)
    off = vector.length(vector.reject_from(direction, up)) * r
    pull = off * off / (off * off + HALF_SWING_DISTANCE * HALF_SWING_DISTANCE)
    swing = atan2(vector.dot(vector.cross(normal, vertical), direction), vector.dot(normal, vertical))
    max_swing = min(MAX_SWING_SPEED_RAD_S * seconds, max_travel / max(radius, 1e-3))
    turn = min(max(swing * (1.0 - exp(-log(2.0) * seconds * pull / SWING_HALF_LIFE_S)), -max_swing), max_swing)
    return _rotate_normal(direction, normal, turn)


def _reach_from_upper_arm(
    geometry: ArmGeometry, upper_arm: Vector, target: Vector, normal: Vector
) -> tuple[Vector, Vector, float]:
    """Return the arm whose forearm and hand come as near to `target` as this upper arm allows."""
    upper, fore, hand, _, _, _ = geometry
    elbow = vector.scale(upper_arm, upper)
    path = vector.subtract(target, elbow)
    shortest = sqrt(fore * fore + hand * hand + 2.0 * fore * hand * cos(MAX_WRIST_BEND_RAD))
    length = min(max(vector.length(path), shortest), fore + hand)
    # where forearm and hand are straight, the cosine has no digits left for the bend
    cosine = (length * length - fore * fore - hand * hand) / (2.0 * fore * hand)
    bend = link.clamped_acos(cosine) if length < fore + hand else 0.0
    lean = atan2(hand * sin(bend), fore + hand * cos(bend))
    side = vector.reject_from(path, upper_arm)
    off = vector.unit(side, vector.cross(normal, upper_arm))
    angle = atan2(vector.dot(path, off), vector.dot(path, upper_arm))
    angle = min(max(angle, lean), min(MAX_ELBOW_BEND_RAD + lean, pi))
    along = vector.add(vector.scale(upper_arm, cos(angle)), vector.scale(off, sin(angle)))
    tip = vector.add(elbow, vector.scale(along, length))
    r = min(vector.length(tip), MAX_TIP_DISTANCE)
    direction = vector.unit(tip, upper_arm)
    low, high = link.bend_limits(geometry, r)
    down = vector.unit(vector.reject_from(upper_arm, direction), vector.cross(direction, normal))
    return (vector.scale(direction, r), vector.cross(down, direction), min(max(bend, low), high))


def lift_angle(elbow: Vector, direction: Vector) -> float:
    """Return the angle of an elbow (from the shoulder, any length) off the unit `direction` of the tip, radians."""
    along = vector.dot(elbow, direction)
    return atan2(sqrt(max(vector.dot(elbow, elbow) - along * along, 0.0)), along)


def _rotate_normal(direction: Vector, normal: Vector, angle: float) -> Vector:
    side = vector.cross(direction, normal)
    turned = vector.add(vector.scale(normal, cos(angle)), vector.scale(side, sin(angle)))
    return vector.scale(turned, 1.0 / vector.length(turned))


def _angle_between(a: Vector, b: Vector) -> float:
    """Return the angle between two unit vectors; from half the chord, because the arc cosine loses small angles."""
    return 2.0 * asin(min(0.5 * vector.length(vector.subtract(a, b)), 1.0))
