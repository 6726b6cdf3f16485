from __future__ import annotations

import pytest

from bunraku.motion.naming.eye_mapping import map_eyes


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("leftEye", "rightEye"),
        ("mixamorig:LeftEye", "mixamorig:RightEye"),
        ("LeftEye_041", "RightEye_042"),
        ("eye.L", "eye.R"),
        ("lEye", "rEye"),
        ("leye", "reye"),
        ("EyeL", "EyeR"),
        ("CC_Base_L_Eye", "CC_Base_R_Eye"),
        ("J_Adj_L_FaceEye", "J_Adj_R_FaceEye"),
        ("l_eyeball_joint", "r_eyeball_joint"),
        ("left_eye_smplhf", "right_eye_smplhf"),
        ("左目", "右目"),
    ],
)
def test_eyes_of_programs_are_found(left: str, right: str) -> None:
    names = ["Neck", "Head", f"{left}_end", left, f"{left}_pupil", right]
    assert map_eyes(names, [-1, 0, 1, 1, 3, 1], 1) == (3, 5)


@pytest.mark.parametrize(
    "names",
    [
        ("LeftEyelid", "RightEyelid"),
        ("eye_target.L", "eye_target.R"),
        ("eyebrow_L", "eyebrow_R"),
        ("LeftEye", "nose"),
        ("Eye", "Eye2"),
        ("", "..."),
    ],
)
def test_other_joints_of_a_head_are_no_eyes(names: tuple[str, str]) -> None:
    assert map_eyes(["Head", *names], [-1, 0, 0], 0) is None


def test_eyes_are_below_the_head() -> None:
    assert map_eyes(["Hips", "Head", "LeftEye", "RightEye"], [-1, 0, 0, 0], 1) is None
