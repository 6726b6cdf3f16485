from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import arm, bend_table
from bunraku.marionette.constants import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD
from bunraku.marionette.proportions import Proportions
from tests.marionette.fixtures import ARM_PROPORTIONS


@given(st.sampled_from(ARM_PROPORTIONS), st.floats(0.0, 1.0), st.floats(-np.pi / 2.0, np.pi / 2.0), st.floats(0.0, 1.0))
def test_chain_closes_on_the_tip_for_every_allowed_bend(
    proportions: Proportions, distance_share: float, beta: float, share: float
) -> None:
    solver = arm.Arm(proportions, bend_table.load_bend_table(proportions.identity))
    r = solver.min_tip_distance + distance_share * (MAX_TIP_DISTANCE - solver.min_tip_distance)
    low, high = solver.bend_limits(r)
    lowest, highest = arm.wrist_bend_limits(proportions, np.array(r))
    assert (low, high) == pytest.approx((float(lowest), float(highest)), abs=1e-12)
    assert low - 1e-12 <= solver.gravity_bend(r, beta) <= high + 1e-12
    t0, t1, t2 = solver.close_chain(r, beta, low + share * (high - low))
    tip = sum(length * np.exp(1j * t) for length, t in zip(proportions.lengths, (t0, t1, t2), strict=True))
    assert abs(tip - r * np.exp(1j * beta)) < 1e-11
    assert -1e-9 <= t1 - t0 <= MAX_ELBOW_BEND_RAD + 1e-9
    assert 0.0 <= t2 - t1 <= MAX_WRIST_BEND_RAD + 1e-9
