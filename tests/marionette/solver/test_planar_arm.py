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


def arm_at(proportions: Proportions, far: float) -> tuple[Arm, float]:
    arm = Arm(proportions, bend_table.load_bend_table(proportions.identity))
    return arm, arm.min_tip_distance + far * (MAX_TIP_DISTANCE - arm.min_tip_distance)


@given(st.sampled_from(ARM_PROPORTIONS), shares, shares)
def test_lift_and_bend_tell_the_same_arm(proportions: Proportions, far: float, share: float) -> None:
    arm, r = arm_at(proportions, far)
    low, high = planar_arm.bend_limits(arm.geometry, r)
    bend = low + share * (high - low)
    lift = planar_arm.lift_for_bend(arm.geometry, r, bend)
    # the bend is what the lift says, as far as its cosine can tell
    assert cos(planar_arm.bend_for_lift(arm.geometry, r, lift, low, high)) == pytest.approx(cos(bend), abs=1e-9)
    t0, t1, t2 = planar_arm.close_chain(arm.geometry, r, 0.0, bend)
    assert -t0 == pytest.approx(lift, abs=1e-9)
    assert t2 - t1 == pytest.approx(bend, abs=1e-12)
    upper, fore, hand, _, _, _ = arm.geometry
    x = upper * cos(t0) + fore * cos(t1) + hand * cos(t2)
    y = upper * sin(t0) + fore * sin(t1) + hand * sin(t2)
    assert (x, y) == pytest.approx((r, 0.0), abs=1e-9)


@given(st.sampled_from(ARM_PROPORTIONS), shares, st.floats(0.0, pi / 2.0))
def test_the_nearer_tip_lifts_the_upper_arm_as_asked(proportions: Proportions, far: float, lift: float) -> None:
    arm, r = arm_at(proportions, far)
    found = planar_arm.max_distance_for_lift(arm.geometry, r, lift)
    assert arm.min_tip_distance <= found <= r
    most = planar_arm.lift_for_bend(arm.geometry, found, planar_arm.bend_limits(arm.geometry, found)[0])
    # all that a nearer hand can give, or as much as was asked for
    assert most >= lift - 1e-6 or found == pytest.approx(arm.min_tip_distance, abs=1e-9)


def test_an_arc_cosine_takes_what_rounding_left_beyond_one() -> None:
    assert planar_arm.clamped_acos(1.0 + 1e-12) == 0.0
    assert planar_arm.clamped_acos(-1.0 - 1e-12) == pi
