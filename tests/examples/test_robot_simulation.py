from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

from examples.robot.simulation import MAX_CATCH_UP_S, Pose, Robot

FRAME_S = 1 / 60


def dance(time_s: float) -> Pose:
    """Return a pose of wide movements, whose arms are lifted beyond a robot's speed and range."""
    wave, vectors = np.sin(2 * np.pi * 0.8 * time_s), np.zeros((18, 3))
    vectors[JOINT_INDEX["l_shoulder"]] = [0, 0, 1.5 + 1.6 * wave]
    vectors[JOINT_INDEX["r_shoulder"]] = [-1.5 - 1.4 * wave, 0, -1 * wave]
    vectors[JOINT_INDEX["r_elbow"]] = [-1.4 - 1.4 * wave, 0, 0]
    vectors[JOINT_INDEX["l_hip"]] = [-0.6 - 0.6 * wave, 0, 0]
    vectors[JOINT_INDEX["l_knee"]] = [0.7 + 0.9 * wave, 0, 0]
    return standard_figure().offsets[0], rotation.from_rotation_vector(vectors)


def test_dance_on_strings_breaks_no_limit_and_does_not_fall() -> None:
    robot = Robot(standard_figure())
    for frame in range(240):
        robot.follow(dance(frame * FRAME_S), FRAME_S)
    summary = robot.measurement.summary()
    assert robot.measurement.limits_broken == 0
    assert summary["falls"] == 0
    assert summary["steps"] > 900
    assert 0.2 < summary["torque_share_max"] <= 1.0 + 1e-6
    assert summary["pose_error_deg_p50"] < 20


def test_robot_without_strings_falls_and_is_set_up_again() -> None:
    robot = Robot(standard_figure(), free=True)
    root, rotations = dance(0.0)
    # leaning forwards by 25 degrees
    rotations[0] = rotation.from_rotation_vector(np.array([0.45, 0.0, 0.0]))
    fell = [robot.follow((root, rotations), FRAME_S) for _ in range(240)]
    assert robot.measurement.falls == sum(fell) > 0
    assert robot.measurement.limits_broken == 0
    after = fell.index(True)
    assert not fell[after + 1]


def test_simulation_is_deterministic() -> None:
    robots = [Robot(standard_figure()) for _ in range(2)]
    for frame in range(30):
        for robot in robots:
            robot.follow(dance(frame * FRAME_S), FRAME_S)
    first, second = (robot.pose for robot in robots)
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])


def test_pose_that_is_not_finite_is_ignored() -> None:
    robot = Robot(standard_figure())
    robot.follow(dance(0.0), FRAME_S)
    before = robot.measurement.steps
    assert not robot.follow((np.full(3, np.nan), dance(0.0)[1]), FRAME_S)
    assert robot.measurement.steps == before


def test_long_pause_is_not_simulated() -> None:
    robot = Robot(standard_figure())
    robot.follow(dance(0.0), 3600.0)
    assert robot.measurement.simulated_s <= MAX_CATCH_UP_S
