import numpy as np
import pytest

from bunraku.motion.bvh import parse_bvh
from bunraku.motion.bvh_kinematics import channel_columns, forward_kinematics, rest_positions
from tests.motion.bvh_samples import HIERARCHY_TEXT, motion_section


def test_quarter_turn_about_z_rotates_the_spine() -> None:
    bvh = parse_bvh(HIERARCHY_TEXT + motion_section(b"1 2 3 90 0 0 0 0 0", b"1 2 3 90 90 0 0 0 0"))
    position, _ = forward_kinematics(bvh, [1])
    assert position[:, 0].tolist() == [[1.0, 2.0, 3.0]] * 2
    # z first, then x about the turned x: the spine, y, goes to -x, then to z
    assert position[:, 1] == pytest.approx(np.array([[-9.5, 2.0, 3.0], [1.0, 2.0, 13.5]]))
    assert rest_positions(bvh).tolist() == [[0.0, 0.0, 0.0], [0.0, 10.5, 0.0]]
    assert channel_columns(bvh) == [0, 6]


@pytest.mark.parametrize("y", [10.5, 0.0])
def test_limb_position_channels_replace_or_extend_the_offset(y: float) -> None:
    channels = b"6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    row = b"0 0 0 0 0 0 0.5 %f 0 0 0 0" % y
    bvh = parse_bvh(HIERARCHY_TEXT.replace(b"3 Zrotation Xrotation Yrotation", channels, 1) + motion_section(row, row))
    position, _ = forward_kinematics(bvh, [1], np.array([1]))
    assert position[0, 1].tolist() == [0.5, 10.5, 0.0]


def test_root_without_position_channels_stays_at_its_offset() -> None:
    bvh = parse_bvh(
        HIERARCHY_TEXT.replace(b"6 Xposition Yposition Zposition", b"3", 1) + motion_section(b"0 0 0 0 0 0")
    )
    assert forward_kinematics(bvh, [0])[0][:, 0].tolist() == [[0.0, 90.0, 0.0]]
