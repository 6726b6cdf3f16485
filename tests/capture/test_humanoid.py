from __future__ import annotations

import numpy as np

from bunraku.capture.humanoid import (
    BONE_BY_LOWER_NAME,
    PARENTS_BY_BONE,
    ROOT_NAME,
    standard_t_pose,
)
from bunraku.motion.humanoid import BONE_JOINTS
from bunraku.motion.skeleton import JOINT_INDEX


def test_there_are_55_bones_with_parents_before_children() -> None:
    assert len(BONE_BY_LOWER_NAME) == 55
    names = list(PARENTS_BY_BONE)
    assert names[0] == ROOT_NAME
    for bone, parent in PARENTS_BY_BONE.items():
        assert parent is None or names.index(parent) < names.index(bone)


def test_bones_of_the_figure_exist() -> None:
    assert BONE_JOINTS.keys() <= PARENTS_BY_BONE.keys()
    assert set(BONE_JOINTS.values()) == JOINT_INDEX.keys() - {"humanoid_root"}


def test_standard_figure_stands_in_a_t_pose() -> None:
    places = {bone: np.array(place) for bone, place in standard_t_pose().items()}
    assert places.keys() > BONE_JOINTS.keys()
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        for above, below in (("UpperArm", "LowerArm"), ("LowerArm", "Hand")):
            x, y, z = places[side + below] - places[side + above]
            assert sign * x > 0.2
            assert abs(y) < 0.02
            assert abs(z) < 0.06
        assert places[side + "LowerLeg"][1] < places[side + "UpperLeg"][1] - 0.3
        assert 0.0 < sign * places[side + "Shoulder"][0] < sign * places[side + "UpperArm"][0]
    assert places["Hips"][1] < places["Spine"][1] < places["Chest"][1] < places["Neck"][1] < places["Head"][1]
