from __future__ import annotations

import numpy as np

from bunraku.capture.humanoid import (
    BONE_BY_LOWER_NAME,
    FIGURE_JOINTS,
    PARENTS_BY_BONE,
    ROOT_NAME,
    standard_offsets,
)
from bunraku.motion.skeleton import JOINT_INDEX


def test_there_are_55_bones_with_parents_before_children() -> None:
    assert len(BONE_BY_LOWER_NAME) == 55
    names = list(PARENTS_BY_BONE)
    assert names[0] == ROOT_NAME
    for bone, parent in PARENTS_BY_BONE.items():
        assert parent is None or names.index(parent) < names.index(bone)


def test_bones_of_the_figure_exist() -> None:
    assert FIGURE_JOINTS.keys() <= PARENTS_BY_BONE.keys()
    assert set(FIGURE_JOINTS.values()) == JOINT_INDEX.keys() - {"humanoid_root"}


def test_standard_offsets_are_a_t_pose() -> None:
    offsets = standard_offsets()
    assert offsets.keys() == FIGURE_JOINTS.keys()
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        for bone in ("LowerArm", "Hand"):
            x, y, z = offsets[side + bone]
            assert sign * x > 0.2
            assert abs(y) < 0.02
            assert abs(z) < 0.06
        np.testing.assert_array_less(offsets[side + "LowerLeg"][1], -0.3)
        assert sign * offsets[side + "UpperArm"][0] > 0.15
    assert offsets["Hips"][1] > 0.8
