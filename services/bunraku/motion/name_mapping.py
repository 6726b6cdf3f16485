"""Mapping of source joints to the figure's joints by their names."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from bunraku.motion.naming_profile import LIMB_JOINT_NAMES, PROFILES, NamingProfile

REQUIRED_LIMB_JOINTS = ("hip", "knee", "shoulder", "elbow")
"""Limb joints that a profile must match on both sides."""


@dataclass(frozen=True, slots=True)
class JointMapping:
    """Source joint index for each H-Anim joint name; `assumptions` are sentences about uncertain choices."""

    profile: str
    joints: dict[str, int]
    assumptions: list[str] = field(default_factory=list)


def normalise_name(name: str) -> str:
    """Return a name without namespace, case and punctuation: "rig:upper_arm.L" -> "upperarml"."""
    local = re.split(r"[:|]", name.strip().rstrip(":|"))[-1]
    return "".join(character for character in local.lower() if character.isalnum())


def is_descendant(parents: Sequence[int], joint: int, ancestor: int) -> bool:
    """Return whether `joint` is below `ancestor`, at any depth."""
    while joint >= 0:
        joint = parents[joint]
        if joint == ancestor:
            return True
    return False


def common_ancestor(parents: Sequence[int], joints: Sequence[int]) -> int:
    """Return the lowest joint that is, or is above, all of `joints`."""
    paths: list[list[int]] = []
    for below in joints:
        joint, path = below, [below]
        while parents[joint] >= 0:
            joint = parents[joint]
            path.append(joint)
        paths.append(path[::-1])
    common = 0
    for step in zip(*paths, strict=False):
        if len(set(step)) > 1:
            break
        common = step[0]
    return common


def map_by_name(names: Sequence[str], parents: Sequence[int]) -> JointMapping | None:
    """Return the mapping of the profile that matches most joints, or None if none matches valid limbs."""
    index: dict[str, int] = {}
    for joint, name in enumerate(names):
        index.setdefault(normalise_name(name), joint)
    best: tuple[int, JointMapping] | None = None
    for profile in PROFILES:
        for prefix in _candidate_prefixes(profile, index):
            joints = _match_profile(profile, prefix, index)
            signed = bool(profile.marker) and any(re.fullmatch(profile.marker, name) for name in index)
            if profile.marker and not signed:
                continue
            score = 2 * len(joints) + signed
            if _has_valid_limbs(joints, parents) and (best is None or score > best[0]):
                best = score, JointMapping(profile.name, joints)
    return best[1] if best else None


def _candidate_prefixes(profile: NamingProfile, index: dict[str, int]) -> list[str]:
    """Return possible common prefixes of all names: those before the left knee's name."""
    found = {""}
    for pattern in profile.limb_patterns["knee"].split("|"):
        knee = pattern.format(side=profile.side_words[0])
        found.update(name.removesuffix(knee) for name in index if name.endswith(knee))
    return sorted(found, key=len)


def _match_profile(profile: NamingProfile, prefix: str, index: dict[str, int]) -> dict[str, int]:
    patterns = dict(profile.trunk_patterns)
    for side, word in zip("lr", profile.side_words, strict=True):
        for joint in LIMB_JOINT_NAMES:
            patterns[f"{side}_{joint}"] = profile.limb_patterns[joint].format(side=word)
    joints = {}
    for joint, pattern in patterns.items():
        for name in pattern.split("|"):
            if (source := index.get(prefix + name)) is not None:
                joints[joint] = source
                break
    return joints


def _has_valid_limbs(joints: dict[str, int], parents: Sequence[int]) -> bool:
    """Return whether all required limb joints exist, each below its predecessor."""
    for side in "lr":
        if any(f"{side}_{joint}" not in joints for joint in REQUIRED_LIMB_JOINTS):
            return False
        for chain in (LIMB_JOINT_NAMES[:4], LIMB_JOINT_NAMES[4:]):
            present = [joints[f"{side}_{joint}"] for joint in chain if f"{side}_{joint}" in joints]
            if not all(is_descendant(parents, below, above) for above, below in itertools.pairwise(present)):
                return False
    return True
