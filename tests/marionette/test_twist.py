from __future__ import annotations

from itertools import pairwise
from math import acos, pi

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.constants import MAX_TWIST_SPEED_RAD_S
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.twist_step import NO_TWIST_LAG
from bunraku.marionette.solver.vector import IDENTITY, JointRotations, Quaternion
from bunraku.marionette.twist import TwistLimiter
from bunraku.motion.skeleton import standard_figure

FRAME_S = 1.0 / 60.0
RIG = ArmRig(standard_figure(), Limb.LEFT_HAND)
DIRECTIONS = [vector.unit(link, link) for link in RIG.bones]
REST: JointRotations = (IDENTITY, IDENTITY, IDENTITY)
parts = st.floats(-1.0, 1.0)
rotations = st.tuples(parts, parts, parts, parts).filter(lambda q: sum(x * x for x in q) > 0.1).map(vector.normalise)
arms = st.tuples(rotations, rotations, rotations)
turns = st.floats(-3.0, 3.0)


def angle(a: Quaternion, b: Quaternion) -> float:
    return 2.0 * acos(min(abs(sum(x * y for x, y in zip(a, b, strict=True))), 1.0))


def orientations(joints: JointRotations) -> JointRotations:
    elbow = vector.multiply(joints[0], joints[1])
    return (joints[0], elbow, vector.multiply(elbow, joints[2]))


def twisted(joints: JointRotations, twists: tuple[float, float, float]) -> JointRotations:
    """Return the joints of the arm with each link twisted about its own axis."""
    first, second, third = (
        vector.multiply(link, vector.from_axis_angle(direction, turn))
        for link, direction, turn in zip(orientations(joints), DIRECTIONS, twists, strict=True)
    )
    elbow = vector.multiply(vector.conjugate(first), second)
    return (first, elbow, vector.multiply(vector.conjugate(second), third))


@given(st.lists(arms, min_size=1, max_size=8), st.floats(0.0, 1.0))
def test_limiting_twist_keeps_joint_positions(requested: list[JointRotations], weight: float) -> None:
    limiter = TwistLimiter(RIG.bones)
    for joints in requested:
        shown = limiter.limit(joints, weight, FRAME_S)
        for shown_position, requested_position in zip(
            RIG.joint_positions(shown), RIG.joint_positions(joints), strict=True
        ):
            assert vector.length(vector.subtract(shown_position, requested_position)) < 1e-7
        for one, other, lag in zip(orientations(shown), orientations(joints), limiter.lag_rad, strict=True):
            assert abs(angle(one, other) - min(abs(lag), 2.0 * pi - abs(lag))) < 1e-6
            assert abs(lag) <= 1.5 * pi * weight


@given(arms, st.tuples(turns, turns, turns))
def test_jump_of_twist_is_limited_to_the_maximum_speed(
    joints: JointRotations, twists: tuple[float, float, float]
) -> None:
    limiter = TwistLimiter(RIG.bones)
    shown = limiter.limit(joints, 1.0, FRAME_S)
    assert shown is joints
    requested = twisted(joints, twists)
    for _ in range(int(max(map(abs, twists)) / (MAX_TWIST_SPEED_RAD_S * FRAME_S)) + 1):
        before, shown = shown, limiter.limit(requested, 1.0, FRAME_S)
        for one, other, jump in zip(orientations(before), orientations(shown), twists, strict=True):
            assert angle(one, other) <= min(abs(jump), MAX_TWIST_SPEED_RAD_S * FRAME_S) + 1e-6
    assert max(map(abs, limiter.lag_rad)) < 1e-9
    assert all(angle(one, other) < 1e-6 for one, other in zip(shown, requested, strict=True))


def test_swing_without_twist_is_unchanged() -> None:
    """An arm that moves in a circle gets no additional twist."""
    limiter = TwistLimiter(RIG.bones)
    axis = vector.any_perpendicular(DIRECTIONS[0])
    for frame in range(60):
        requested = (vector.from_axis_angle(axis, 0.2 * frame), IDENTITY, IDENTITY)
        assert limiter.limit(requested, 1.0, FRAME_S) is requested


def test_lag_behind_constant_rotation_keeps_its_direction() -> None:
    """By the shortest rotation a link that lags by half a turn would turn back."""
    limiter = TwistLimiter(RIG.bones)
    lag = []
    for frame in range(60):
        limiter.limit(twisted(REST, (0.4 * frame, 0.0, 0.0)), 1.0, FRAME_S)
        lag.append(limiter.lag_rad[0])
    index_of_least = lag.index(min(lag))
    assert lag[index_of_least] < -pi
    assert all(later <= earlier for earlier, later in pairwise(lag[: index_of_least + 1]))


@given(arms, arms)
def test_weight_zero_returns_the_joints_unchanged(one: JointRotations, other: JointRotations) -> None:
    limiter = TwistLimiter(RIG.bones)
    limiter.limit(one, 1.0, FRAME_S)
    assert limiter.limit(other, 0.0, FRAME_S) is other
    assert limiter.lag_rad == NO_TWIST_LAG
