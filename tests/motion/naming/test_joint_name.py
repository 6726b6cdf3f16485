from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.naming.joint_name import NameIndex, find_spellings, normalise_name, split_words, strip_numbers
from bunraku.motion.naming.naming_profile import PROFILES


@pytest.mark.parametrize(
    ("name", "plain"),
    [("rig:upper_arm.L", "upperarml"), ("Bip01 L Thigh", "bip01lthigh"), ("a|b|Hips", "hips"), ("Hips:", "hips")],
)
def test_names_are_normalised(name: str, plain: str) -> None:
    assert normalise_name(name) == plain


@given(name=st.text(max_size=30))
def test_normalised_name_is_stable(name: str) -> None:
    plain = normalise_name(name)
    assert plain == "" or plain.isalnum()
    assert normalise_name(plain) == plain


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rig:upper_arm.L", ["upper", "arm", "l"]),
        ("LThigh", ["l", "thigh"]),
        ("leftUpLeg2", ["left", "up", "leg", "2"]),
        ("LEFT_ARM", ["left", "arm"]),
        ("上半身2", ["上半身", "2"]),
    ],
)
def test_names_are_split_into_words(name: str, words: list[str]) -> None:
    assert split_words(name) == words


def test_numbers_of_joints_are_removed_if_most_names_have_one() -> None:
    names = ["root", "Hips_01", "Spine_02", "Spine1_03", "LeftArm_012"]
    assert strip_numbers(names) == ["root", "Hips", "Spine", "Spine1", "LeftArm"]
    assert strip_numbers(["pelvis", "spine_01", "spine_02", "head"]) is None
    assert strip_numbers([]) is None


def test_spelling_leads_from_one_knee_to_all_joints() -> None:
    names = ["rig_Pelvis_jnt", "rig_L_Calf_jnt", "rig_R_Calf_jnt"]
    index = NameIndex(names, [-1, 0, 0])
    profile = next(profile for profile in PROFILES if profile.name == "Unreal")
    spelling = find_spellings(profile, index)[0]
    assert [index.find(spelling.limb_key(side, "calf"), 0, ()) for side in (0, 1)] == [1, 2]
    assert index.find(spelling.trunk_key("pelvis"), None, ()) == 0
    assert index.find(spelling.limb_key(0, "calf"), None, {1}) is None


def test_many_names_like_a_knee_give_few_spellings() -> None:
    index = NameIndex([f"a{number}leftleg" for number in range(1000)], [-1, *range(999)])
    assert all(len(find_spellings(profile, index)) <= 64 for profile in PROFILES)
