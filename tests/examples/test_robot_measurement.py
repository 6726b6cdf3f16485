from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure
from examples.robot.joints import HINGE_COUNT, LOWER, TORQUE_LIMITS, UPPER
from examples.robot.measurement import BONES, JOINT_TOLERANCE, Measurement, bone_errors


def test_limits_count_once_for_each_hinge_and_step() -> None:
    measurement, angles, torques = Measurement(), np.zeros(HINGE_COUNT), np.zeros(HINGE_COUNT)
    measurement.add_step(angles, TORQUE_LIMITS)
    assert measurement.limits_broken == 0
    angles[:2] = UPPER[0] + 2 * JOINT_TOLERANCE, LOWER[1] - 2 * JOINT_TOLERANCE
    torques[3] = -1.01 * TORQUE_LIMITS[3]
    measurement.add_step(angles, torques)
    summary = measurement.summary()
    assert (summary["joint_limits_broken"], summary["torque_limits_broken"]) == (2, 1)
    assert measurement.limits_broken == 3


def test_value_that_is_not_a_number_breaks_the_limits() -> None:
    measurement = Measurement()
    measurement.add_step(np.full(HINGE_COUNT, np.nan), np.full(HINGE_COUNT, np.nan))
    assert measurement.limits_broken == 2 * HINGE_COUNT


def test_summary_of_an_empty_run_has_no_errors() -> None:
    assert Measurement().summary()["pose_error_deg_p95"] is None


def test_bone_errors_are_seen_from_the_pelvis() -> None:
    wanted = np.tile([1.0, 0, 0, 0], (18, 1))
    reached = wanted.copy()
    reached[0] = rotation.from_rotation_vector(np.array([0.0, 1.0, 0.0]))
    reached[JOINT_INDEX["l_knee"]] = rotation.from_rotation_vector(np.array([0.5, 0.0, 0.0]))
    errors = dict(zip(BONES, bone_errors(standard_figure(), wanted, reached), strict=True))
    shin = errors.pop((JOINT_INDEX["l_knee"], JOINT_INDEX["l_ankle"]))
    assert shin == pytest.approx(0.5, abs=0.05)
    assert max(errors.values()) < 1e-6
