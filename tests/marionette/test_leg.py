from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import leg


@given(st.floats(-10.0, 10.0))
def test_the_knee_bends_one_way_and_lets_the_shank_hang(theta: float) -> None:
    hip, knee = leg.solve(np.array([theta]))
    assert leg.THIGH_LEAST <= hip[0] <= leg.THIGH_GREATEST
    assert hip[0] == leg.clamp_thigh(theta)
    assert knee[0] == leg.knee_bend(leg.clamp_thigh(theta)) >= 0.0
    # the shank's own angle from straight down
    assert hip[0] - knee[0] == min(hip[0], 0.0)
