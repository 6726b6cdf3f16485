"""One time step of the twist of an arm's bones, at a bounded speed.

The position of a bone does not determine its twist, the rotation about its own axis. An arm that is almost straight may
lie in any plane; an elbow that hardly moves turns that plane, and with it the twist of the whole upper arm. A wrist
that bends a little more may turn the palm over. So each bone has a shown twist that lags behind the requested one when
that changes faster than `MAX_TWIST_SPEED_RAD_S`. Shoulder, elbow and wrist trade the difference, and no joint moves.

Plain functions of plain numbers, so that `_kernels` can compile them.
"""

from __future__ import annotations

from math import atan2, copysign, pi

from bunraku.marionette.constants import MAX_TWIST_LAG_RAD, MAX_TWIST_SPEED_RAD_S
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import JointRotations, Quaternion, Vector

NO_TWIST_LAG = (0.0, 0.0, 0.0)

BoneDirections = tuple[Vector, Vector, Vector]
"""Unit vectors along three bones at rest."""


def limit_twist(
    directions: BoneDirections,
    orientations: JointRotations,
    lag_rad: Vector,
    joints: JointRotations,
    share: float,
    seconds: float,
) -> tuple[JointRotations, JointRotations, Vector]:
    """Return the shown joints, the shown orientations of the bones and the lag of each bone's twist.

    The last two are the state: they are `orientations` and `lag_rad` of the next step.
    """
    max_lag, step = MAX_TWIST_LAG_RAD * share, MAX_TWIST_SPEED_RAD_S * seconds
    first, second = joints[0], vector.multiply(joints[0], joints[1])
    third = vector.multiply(second, joints[2])
    first, one = _limit_bone_twist(directions[0], orientations[0], lag_rad[0], first, max_lag, step)
    second, two = _limit_bone_twist(directions[1], orientations[1], lag_rad[1], second, max_lag, step)
    third, three = _limit_bone_twist(directions[2], orientations[2], lag_rad[2], third, max_lag, step)
    elbow = vector.normalise(vector.multiply(vector.conjugate(first), second))
    wrist = vector.normalise(vector.multiply(vector.conjugate(second), third))
    return (first, elbow, wrist), (first, second, third), (one, two, three)


def _limit_bone_twist(
    direction: Vector, orientation: Quaternion, lag_rad: float, target: Quaternion, max_lag: float, max_step: float
) -> tuple[Quaternion, float]:
    """Return the shown orientation of a bone and its lag.

    `orientation` is the shown one of the last step and `lag_rad` its lag then; `target` is the requested orientation
    now. The lag is at most `max_lag` and `max_step` smaller than if the bone had kept its twist.
    """
    along = vector.rotate(target, direction)
    carried = vector.multiply(vector.rotation_between(vector.rotate(orientation, direction), along), orientation)
    w, x, y, z = vector.multiply(carried, vector.conjugate(target))
    angle = 2.0 * atan2(vector.dot((x, y, z), along), w)
    # keep the way round unless it is much longer by now
    angle += 2.0 * pi * round((lag_rad - angle) / (2.0 * pi))
    if abs(angle) > MAX_TWIST_LAG_RAD:
        angle -= 2.0 * pi * round(angle / (2.0 * pi))
    left = min(max(abs(angle) - max_step, 0.0), max_lag)
    angle = copysign(left, angle) if left > 0.0 else 0.0
    return vector.normalise(vector.multiply(vector.from_axis_angle(along, angle), target)), angle
