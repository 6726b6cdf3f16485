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


def twisted(joints: JointRotations, by: tuple[float, float, float]) -> JointRotations:
    """The same arm with its links turned about themselves."""
    first, second, third = (
        vector.multiply(link, vector.from_axis_angle(direction, turn))
        for link, direction, turn in zip(orientations(joints), DIRECTIONS, by, strict=True)
    )
    elbow = vector.multiply(vector.conjugate(first), second)
    return (first, elbow, vector.multiply(vector.conjugate(second), third))


@given(st.lists(arms, min_size=1, max_size=8), st.floats(0.0, 1.0))
def test_all_places_are_where_they_are_wanted_however_the_links_are_turned(
    wanted: list[JointRotations], share: float
) -> None:
    spins = TwistLimiter(RIG.bones)
    for joints in wanted:
        shown = spins.limit(joints, share, FRAME_S)
        for here, there in zip(RIG.joint_positions(shown), RIG.joint_positions(joints), strict=True):
            assert vector.length(vector.subtract(here, there)) < 1e-7
        for one, other, behind in zip(orientations(shown), orientations(joints), spins.lag_rad, strict=True):
            assert abs(angle(one, other) - min(abs(behind), 2.0 * pi - abs(behind))) < 1e-6
            assert abs(behind) <= 1.5 * pi * share


@given(arms, st.tuples(turns, turns, turns))
def test_links_that_jump_about_themselves_come_over_at_a_bounded_speed(
    joints: JointRotations, by: tuple[float, float, float]
) -> None:
    spins = TwistLimiter(RIG.bones)
    shown = spins.limit(joints, 1.0, FRAME_S)
    assert shown is joints
    wanted = twisted(joints, by)
    for _ in range(int(max(map(abs, by)) / (MAX_TWIST_SPEED_RAD_S * FRAME_S)) + 1):
        before, shown = shown, spins.limit(wanted, 1.0, FRAME_S)
        for one, other, jump in zip(orientations(before), orientations(shown), by, strict=True):
            assert angle(one, other) <= min(abs(jump), MAX_TWIST_SPEED_RAD_S * FRAME_S) + 1e-6
    assert max(map(abs, spins.lag_rad)) < 1e-9
    assert all(angle(one, other) < 1e-6 for one, other in zip(shown, wanted, strict=True))


def test_a_link_that_swings_is_carried_without_being_turned() -> None:
    """On the shortest way: an arm that goes round a circle is turned by nothing that was not asked for."""
    spins = TwistLimiter(RIG.bones)
    aside = vector.any_perpendicular(DIRECTIONS[0])
    for frame in range(60):
        wanted = (vector.from_axis_angle(aside, 0.2 * frame), IDENTITY, IDENTITY)
        assert spins.limit(wanted, 1.0, FRAME_S) is wanted


def test_what_goes_round_and_round_is_kept_up_with_on_the_way_it_goes() -> None:
    """By the shortest way a link that is behind would turn back where half a circle is left."""
    spins = TwistLimiter(RIG.bones)
    behind = []
    for frame in range(60):
        spins.limit(twisted(REST, (0.4 * frame, 0.0, 0.0)), 1.0, FRAME_S)
        behind.append(spins.lag_rad[0])
    least = behind.index(min(behind))
    assert behind[least] < -pi
    assert all(later <= sooner for sooner, later in pairwise(behind[: least + 1]))


@given(arms, arms)
def test_with_no_share_left_the_joints_are_as_wanted(one: JointRotations, other: JointRotations) -> None:
    spins = TwistLimiter(RIG.bones)
    spins.limit(one, 1.0, FRAME_S)
    assert spins.limit(other, 0.0, FRAME_S) is other
    assert spins.lag_rad == NO_TWIST_LAG
