from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import arm, table
from bunraku.marionette.proportions import ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, Proportions
from tests.marionette.arms import ARMS


@given(st.sampled_from(ARMS), st.floats(0.0, 1.0), st.floats(-np.pi / 2.0, np.pi / 2.0), st.floats(0.0, 1.0))
def test_every_bend_within_the_limits_closes_on_the_tip(
    proportions: Proportions, far: float, beta: float, share: float
) -> None:
    one = arm.Arm(proportions, table.table_of(proportions.identity))
    r = one.inner + far * (OUTER_RADIUS - one.inner)
    low, high = one.limits(r)
    lowest, highest = arm.bend_limits(proportions, np.array(r))
    assert (low, high) == pytest.approx((float(lowest), float(highest)), abs=1e-12)
    assert low - 1e-12 <= one.bend(r, beta) <= high + 1e-12
    t0, t1, t2 = one.close(r, beta, low + share * (high - low))
    along = sum(size * np.exp(1j * t) for size, t in zip(proportions.lengths, (t0, t1, t2), strict=True))
    assert abs(along - r * np.exp(1j * beta)) < 1e-11
    assert -1e-9 <= t1 - t0 <= ELBOW_LIMIT + 1e-9
    assert 0.0 <= t2 - t1 <= WRIST_LIMIT + 1e-9
