from __future__ import annotations

from math import cos, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import bend_table
from bunraku.marionette.arm import Arm
from bunraku.marionette.constants import MAX_TIP_DISTANCE
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver import planar_arm
from tests.marionette.fixtures import ARM_PROPORTIONS

shares = st.floats(0.0, 1.0)


def arm_at(proportions: Proportions, distance_share: float) -> tuple[Arm, float]:
    arm = Arm(proportions, bend_table.load_bend_table(proportions.identity))
    return arm, arm.min_tip_distance + distance_share * (MAX_TIP_DISTANCE - arm.min_tip_distance)


@given(st.sampled_from(ARM_PROPORTIONS), shares, shares)
def test_lift_and_bend_are_inverse(proportions: Proportions, distance_share: float, share: float) -> None:
    arm, r = arm_at(proportions, distance_share)
    low, high = planar_arm.bend_limits(arm.geometry, r)
    bend = low + share * (high - low)
    lift = planar_arm.lift_for_bend(arm.geometry, r, bend)
    # compare cosines, as acos is inaccurate near 1
    assert cos(planar_arm.bend_for_lift(arm.geometry, r, lift, low, high)) == pytest.approx(cos(bend), abs=1e-9)
    t0, t1, t2 = planar_arm.close_chain(arm.geometry, r, 0.0, bend)
    assert -t0 == pytest.approx(lift, abs=1e-9)
    assert t2 - t1 == pytest.approx(bend, abs=1e-12)
    upper, forearm, hand, _, _, _ = arm.geometry
    x = upper * cos(t0) + forearm * cos(t1) + hand * cos(t2)
    y = upper * sin(t0) + forearm * sin(t1) + hand * sin(t2)
    assert (x, y) == pytest.approx((r, 0.0), abs=1e-9)


@given(st.sampled_from(ARM_PROPORTIONS), shares, st.floats(0.0, pi / 2.0))
def test_max_distance_for_lift_reaches_the_lift(proportions: Proportions, distance_share: float, lift: float) -> None:
    arm, r = arm_at(proportions, distance_share)
    distance = planar_arm.max_distance_for_lift(arm.geometry, r, lift)
    assert arm.min_tip_distance <= distance <= r
    max_lift = planar_arm.lift_for_bend(arm.geometry, distance, planar_arm.bend_limits(arm.geometry, distance)[0])
    # the requested lift, or the greatest that a nearer hand allows
    assert max_lift >= lift - 1e-6 or distance == pytest.approx(arm.min_tip_distance, abs=1e-9)


def test_clamped_acos_accepts_values_slightly_beyond_one() -> None:
    assert planar_arm.clamped_acos(1.0 + 1e-12) == 0.0
    assert planar_arm.clamped_acos(-1.0 - 1e-12) == pi
