from __future__ import annotations

from math import cos, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import links, table
from bunraku.marionette.arm import Arm
from bunraku.marionette.proportions import OUTER_RADIUS, Proportions
from tests.marionette.arms import ARMS

shares = st.floats(0.0, 1.0)


def arm_at(proportions: Proportions, far: float) -> tuple[Arm, float]:
    arm = Arm(proportions, table.table_of(proportions.identity))
    return arm, arm.inner + far * (OUTER_RADIUS - arm.inner)


@given(st.sampled_from(ARMS), shares, shares)
def test_lift_and_bend_tell_the_same_arm(proportions: Proportions, far: float, share: float) -> None:
    arm, r = arm_at(proportions, far)
    low, high = links.limits(arm.links, r)
    bend = low + share * (high - low)
    lift = links.lift_of(arm.links, r, bend)
    # the bend is what the lift says, as far as its cosine can tell
    assert cos(links.bend_of(arm.links, r, lift, low, high)) == pytest.approx(cos(bend), abs=1e-9)
    t0, t1, t2 = links.close(arm.links, r, 0.0, bend)
    assert -t0 == pytest.approx(lift, abs=1e-9)
    assert t2 - t1 == pytest.approx(bend, abs=1e-12)
    upper, fore, hand, _, _, _ = arm.links
    x = upper * cos(t0) + fore * cos(t1) + hand * cos(t2)
    y = upper * sin(t0) + fore * sin(t1) + hand * sin(t2)
    assert (x, y) == pytest.approx((r, 0.0), abs=1e-9)


@given(st.sampled_from(ARMS), shares, st.floats(0.0, pi / 2.0))
def test_the_nearer_tip_lifts_the_upper_arm_as_asked(proportions: Proportions, far: float, lift: float) -> None:
    arm, r = arm_at(proportions, far)
    found = links.nearer(arm.links, r, lift)
    assert arm.inner <= found <= r
    most = links.lift_of(arm.links, found, links.limits(arm.links, found)[0])
    # all that a nearer hand can give, or as much as was asked for
    assert most >= lift - 1e-6 or found == pytest.approx(arm.inner, abs=1e-9)


def test_an_arc_cosine_takes_what_rounding_left_beyond_one() -> None:
    assert links.arc_cosine(1.0 + 1e-12) == 0.0
    assert links.arc_cosine(-1.0 - 1e-12) == pi
