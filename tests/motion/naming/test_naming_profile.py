from __future__ import annotations

import re

import pytest

from bunraku.motion.naming.joint_name import normalise_name
from bunraku.motion.naming.naming_profile import LIMB_JOINT_NAMES, PROFILES, SIDE_WORDS, NamingProfile
from bunraku.motion.skeleton import JOINTS

NAMED: tuple[str, ...] = (
    "H-Anim 1",
    "H-Anim 2",
    "CMU (cgspeed)",
    "MotionBuilder",
    "Mixamo",
    "Blender",
    "Rokoko",
    "LAFAN",
    "Xsens",
)
NAMED += ("Perception Neuron", "3ds Max Biped", "VRM", "SMPL", "SOMA (BONES-SEED)", "Bandai-Namco", "MocapNET")
NAMED += ("MakeHuman", "mocopi", "Unreal", "Character Creator", "Daz", "MikuMikuDance")


def all_patterns(profile: NamingProfile) -> list[str]:
    patterns = [*profile.trunk_patterns.values(), *profile.limb_patterns.values()]
    return [name for pattern in patterns for name in pattern.split("|")]


def test_profile_names_are_unique() -> None:
    assert len({profile.name for profile in PROFILES}) == len(PROFILES)


@pytest.mark.parametrize("name", NAMED)
def test_required_programs_have_a_profile(name: str) -> None:
    assert name in [profile.name for profile in PROFILES]


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_profile_maps_each_joint_once(profile: NamingProfile) -> None:
    assert set(profile.trunk_patterns) <= set(JOINTS)
    assert {f"{side}_{joint}" for side in "lr" for joint in profile.limb_patterns} <= set(JOINTS)
    assert set(profile.limb_patterns) == set(LIMB_JOINT_NAMES)
    # the first choice of each joint is no other's; a later one may be: a foot without an ankle is the ankle
    first = [pattern.split("|")[0] for pattern in profile.limb_patterns.values()]
    assert len(set(first)) == len(first)
    # patterns are compared with bare names: one that is not bare would never be found
    names = all_patterns(profile)
    assert names == [normalise_name(name) for name in names]
    assert profile.side_words in SIDE_WORDS


@pytest.mark.parametrize("profile", [p for p in PROFILES if p.marker], ids=lambda profile: profile.name)
def test_markers_match_normalised_names(profile: NamingProfile) -> None:
    assert not re.fullmatch(profile.marker, "")
    assert profile.marker == profile.marker.lower()
