from __future__ import annotations

import re

import pytest

from bunraku.motion.name_mapping import normalise_name
from bunraku.motion.naming_profile import LIMB_JOINT_NAMES, PROFILES, NamingProfile
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
NAMED += ("Perception Neuron", "3ds Max Biped", "VRM")


def all_patterns(profile: NamingProfile) -> list[str]:
    limbs = [
        profile.limb_patterns[joint].format(side=side) for side in profile.side_words for joint in LIMB_JOINT_NAMES
    ]
    return [name for pattern in [*profile.trunk_patterns.values(), *limbs] for name in pattern.split("|")]


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
    names = all_patterns(profile)
    assert len(set(names)) == len(names)
    # patterns are compared with bare names: one that is not bare would never be found
    assert names == [normalise_name(name) for name in names]


@pytest.mark.parametrize("profile", [p for p in PROFILES if p.marker], ids=lambda profile: profile.name)
def test_markers_match_normalised_names(profile: NamingProfile) -> None:
    assert not re.fullmatch(profile.marker, "")
    assert profile.marker == profile.marker.lower()
