"""Mapping of source joints to the figure's joints by their names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.naming.joint_name import NameIndex, Spelling, find_spellings, split_words, strip_numbers
from bunraku.motion.naming.naming_profile import LIMB_JOINT_NAMES, PROFILES, NamingProfile

REQUIRED_LIMB_JOINTS = ("hip", "knee", "shoulder", "elbow")
"""Limb joints that a profile must match on both sides."""
SHAPE_PROFILE = "shape"
"""Profile of a mapping by the skeleton's shape, whose left and right are interchangeable."""


@dataclass(frozen=True, slots=True)
class JointMapping:
    """Source joint index for each H-Anim joint name, and the naming convention that gave them."""

    profile: str
    joints: dict[str, int]


def map_by_name(names: Sequence[str], parents: Sequence[int]) -> JointMapping | None:
    """Return the mapping of the profile that matches most joints, or None if none matches both arms and legs.

    If none does and most names end in a number of their own, as "LeftArm_012", they are compared without it.
    """
    found = _map_names(names, parents)
    if found is None and (stripped := strip_numbers(names)) is not None:
        return _map_names(stripped, parents)
    return found


def _map_names(names: Sequence[str], parents: Sequence[int]) -> JointMapping | None:
    index = NameIndex(names, parents)
    best: tuple[tuple[int, bool, bool], JointMapping] | None = None
    for profile in PROFILES:
        is_marked = index.has_name(profile.marker) if profile.marker else False
        if profile.marker and not is_marked:
            continue
        for spelling in find_spellings(profile, index):
            joints = _match_profile(profile, spelling, index)
            score = (len(joints), is_marked, spelling.words == profile.side_words)
            if joints and (best is None or score > best[0]):
                best = score, JointMapping(profile.name, joints)
    return best[1] if best else None


def find_head_by_name(names: Sequence[str], parents: Sequence[int], joints: dict[str, int]) -> int | None:
    """Return the first joint that is named as a head and is in none of the limbs in `joints`; None if none is."""
    limbs = [joints[f"{side}_{joint}"] for side in "lr" for joint in ("hip", "shoulder")]
    for joint, name in enumerate(names):
        if split_words(name)[-1:] in (["head"], ["頭"]):
            above = ancestor_chain(parents, joint)
            if not any(limb in above for limb in limbs):
                return joint
    return None


def _match_profile(profile: NamingProfile, spelling: Spelling, index: NameIndex) -> dict[str, int]:
    """Return the joints of a profile, each below the previous one of its limb; empty if an arm or leg is incomplete.

    The end of a limb may have the same name on both sides, as it is below joints of one side.
    """
    joints: dict[str, int] = {}
    for side, letter in enumerate("lr"):
        for chain in (LIMB_JOINT_NAMES[:4], LIMB_JOINT_NAMES[4:]):
            above = None
            for joint in chain:
                patterns = profile.limb_patterns[joint].split("|")
                keys = [spelling.limb_key(side, pattern) for pattern in patterns]
                if joint not in REQUIRED_LIMB_JOINTS:
                    keys += [spelling.trunk_key(pattern) for pattern in patterns]
                places = (index.find(key, above, joints.values()) for key in keys)
                found = next((place for place in places if place is not None), None)
                if found is not None:
                    joints[f"{letter}_{joint}"] = above = found
                elif joint in REQUIRED_LIMB_JOINTS:
                    return {}
    for joint, pattern in profile.trunk_patterns.items():
        keys = [spelling.trunk_key(one) for one in pattern.split("|")] + pattern.split("|")
        places = (index.find(key, None, joints.values()) for key in keys)
        if (found := next((place for place in places if place is not None), None)) is not None:
            joints[joint] = found
    return joints
