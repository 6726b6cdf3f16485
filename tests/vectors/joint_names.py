"""Naming conventions of joints (`proto/joint_names.json`), which readers of motions and of avatars share."""

from __future__ import annotations

from typing import Any

from bunraku.motion.naming.naming_profile import LIMB_JOINT_NAMES, PROFILES, SIDE_WORDS


def make_document() -> dict[str, Any]:
    """Return the words for left and right, and the patterns of each convention."""
    return {
        "side_words": SIDE_WORDS,
        "limb_joints": LIMB_JOINT_NAMES,
        "profiles": [
            {
                "name": profile.name,
                "side_words": profile.side_words,
                "trunk": profile.trunk_patterns,
                "limbs": profile.limb_patterns,
                "marker": profile.marker,
            }
            for profile in PROFILES
        ],
    }
