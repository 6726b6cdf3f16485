from __future__ import annotations

import re

import pytest

from bunraku.motion.naming import bare
from bunraku.motion.profiles import LIMB_JOINTS, PROFILES, Profile
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


def patterns(profile: Profile) -> list[str]:
    limbs = [profile.limbs[joint].format(side=side) for side in profile.sides for joint in LIMB_JOINTS]
    return [name for pattern in [*profile.centre.values(), *limbs] for name in pattern.split("|")]


def test_every_profile_has_a_name_of_its_own() -> None:
    assert len({profile.name for profile in PROFILES}) == len(PROFILES)


@pytest.mark.parametrize("name", NAMED)
def test_programs_that_must_be_known_are(name: str) -> None:
    assert name in [profile.name for profile in PROFILES]


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_a_profile_names_joints_of_the_figure_and_each_but_once(profile: Profile) -> None:
    assert set(profile.centre) <= set(JOINTS)
    assert {f"{side}_{joint}" for side in "lr" for joint in profile.limbs} <= set(JOINTS)
    assert set(profile.limbs) == set(LIMB_JOINTS)
    names = patterns(profile)
    assert len(set(names)) == len(names)
    # patterns are compared with bare names: one that is not bare would never be found
    assert names == [bare(name) for name in names]


@pytest.mark.parametrize("profile", [p for p in PROFILES if p.sign], ids=lambda profile: profile.name)
def test_signs_are_regular_expressions_on_bare_names(profile: Profile) -> None:
    assert not re.fullmatch(profile.sign, "")
    assert profile.sign == profile.sign.lower()
