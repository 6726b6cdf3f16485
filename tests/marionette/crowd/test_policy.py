from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette.crowd.policy import gesture_points, to_point, to_target
from bunraku.marionette.crowd.summary import UNITS


def test_point_and_target_are_inverse_within_a_unit() -> None:
    for limb, values in ((1, (0.3, -0.4, 0.5)), (6, (-0.7, 0.0, 0.0)), (3, (2.0, 0.0, 0.0))):
        x, y, z = to_point(limb, values)
        assert to_target(limb, (x / UNITS, y / UNITS, z / UNITS)) == pytest.approx(values, abs=3 / UNITS)


def test_gestures_of_both_hands_are_mirrored_and_within_reach() -> None:
    left, right = gesture_points(0), gesture_points(5)
    assert (left == right * [-1, 1, 1]).all()
    assert (np.linalg.norm(left, axis=1) <= UNITS).all()
    assert (gesture_points(2)[:, 1:] == 0).all()
