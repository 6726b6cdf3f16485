from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.face import EXPRESSIONS
from bunraku.motion.naming.expression_mapping import describe_unknown, map_expression_name, map_expressions


@pytest.mark.parametrize("name", EXPRESSIONS)
@pytest.mark.parametrize("change", [str, str.upper, str.lower, "rig:{}".format, "blendShape1.{}".format])
def test_names_of_arkit_and_vrm_are_found(name: str, change) -> None:  # type: ignore[no-untyped-def]
    assert map_expression_name(change(name)) == name


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # ARKit with prefixes and sides
        ("Face_M_K_jawOpen", "jawOpen"),
        ("Head.eyeBlinkLeft", "eyeBlinkLeft"),
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("EyeBlink_R", "eyeBlinkRight"),
        ("browDownL", "browDownLeft"),
        ("CTRL_expressions_mouthSmileR", "mouthSmileRight"),
        ("AK_09_JawOpen", "jawOpen"),
        ("AK_01_BrowDownLeft", "browDownLeft"),
        ("mouth_smile_left", "mouthSmileLeft"),
        ("Mouth Smile Left", "mouthSmileLeft"),
        ("ns:Face.cheek-puff", "cheekPuff"),
        ("jaw_L", "jawLeft"),
        ("headEyeBlinkLeft", "eyeBlinkLeft"),
        ("blinkL", "blinkLeft"),
        # visemes and Ready Player Me
        ("viseme_aa", "aa"),
        ("vrc.v_ou", "ou"),
        ("mouthOpen", "jawOpen"),
        ("eyesClosed", "blink"),
        # VRM 0.x and VRoid
        ("joy", "happy"),
        ("Sorrow", "sad"),
        ("FUN", "relaxed"),
        ("A", "aa"),
        ("I", "ih"),
        ("U", "ou"),
        ("E", "ee"),
        ("O", "oh"),
        ("Blink_L", "blinkLeft"),
        ("blink.R", "blinkRight"),
        ("LookUp", "lookUp"),
        ("Fcl_MTH_A", "aa"),
        ("Face.M_F00_000_00_Fcl_ALL_Joy", "happy"),
        ("Fcl_ALL_Joy", "happy"),
        ("Fcl_EYE_Close_L", "blinkLeft"),
        # Character Creator 4
        ("Eye_Blink_L", "eyeBlinkLeft"),
        ("Eye_L_Look_L", "eyeLookOutLeft"),
        ("Eye_R_Look_L", "eyeLookInRight"),
        ("Brow_Drop_R", "browDownRight"),
        ("Mouth_Down_Lower_L", "mouthLowerDownLeft"),
        ("Jaw_Forward", "jawForward"),
        # Mixamo
        ("Smile_Left", "mouthSmileLeft"),
        ("EyesWide_Right", "eyeWideRight"),
        ("UpperLipUp_Left", "mouthUpperUpLeft"),
        # MikuMikuDance
        ("あ", "aa"),
        ("まばたき", "blink"),
        # unknown
        ("smile", None),
        ("Fcl_BRW_Joy", None),
        ("head_a", None),
        ("body_fat", None),
        ("left", None),
        ("L", None),
        ("", None),
        ("...", None),
    ],
)
def test_names_of_programs_are_mapped(name: str, expected: str | None) -> None:
    assert map_expression_name(name) == expected


def test_largest_weight_of_shapes_with_the_same_expression_counts() -> None:
    shapes = {"skin.eyeBlink_L": np.array([0.2, 0.6]), "lashes.eyeBlink_L": np.array([0.4, 0.1])}
    found, unknown = map_expressions(shapes)
    assert unknown == []
    np.testing.assert_array_equal(found["eyeBlinkLeft"], [0.4, 0.6])


def test_only_unknown_shapes_that_move_are_listed() -> None:
    moving = {f"shape{number}": np.array([0.0, 1.0]) for number in range(6)}
    found, unknown = map_expressions(moving | {"still": np.zeros(2)})
    assert found == {}
    sentence = describe_unknown(unknown)
    assert sentence.endswith("left out: 'shape0', 'shape1', 'shape2', 'shape3' and 2 more.")


@given(st.text(max_size=400))
def test_any_name_is_mapped_or_unknown(name: str) -> None:
    assert map_expression_name(name) in (None, *EXPRESSIONS)
