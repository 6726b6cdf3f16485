from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, standard_figure
from bunraku.pose_picture import ROWS, draw_pose


def still() -> np.ndarray:
    return np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


def test_standing_body_fills_the_height() -> None:
    lines = draw_pose(standard_figure(), np.zeros(3), still()).split("\n")
    assert len(lines) == ROWS
    assert lines[0].strip("\u2800 ")
    assert lines[-1].strip("\u2800 ")
    assert max(map(len, lines)) <= 2 * ROWS


def test_raised_left_arm_is_on_the_right_of_the_picture() -> None:
    rotations = still()
    rotations[JOINT_INDEX["l_shoulder"]] = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    hanging, raised = (draw_pose(standard_figure(), np.zeros(3), each).split("\n") for each in (still(), rotations))
    assert max(map(len, raised)) > max(map(len, hanging))


def test_a_point_is_drawn() -> None:
    figure = standard_figure()
    flat = type(figure)(np.zeros_like(figure.offsets), np.zeros_like(figure.tips))
    assert draw_pose(flat, np.zeros(3), still()).startswith("\u2801")
