"""Joint naming conventions of capture and animation programs.

Patterns are words without a side: any profile is found with any word for left and right, before or behind the pattern,
and with anything before or after it that all names share ("Character1_", "_jnt"). Names are compared without case and
everything but letters and digits: "upper_arm.L" is `upperarm` on the left. In a pattern `|` separates alternatives, the
first choice first. A `marker` is a regular expression on the normalised names that distinguishes a profile from another
with the same names; it does not contribute to the mapping.
"""

from __future__ import annotations

from dataclasses import dataclass

LIMB_JOINT_NAMES = ("hip", "knee", "ankle", "midtarsal", "shoulder", "elbow", "wrist")
SIDE_WORDS: tuple[tuple[str, str], ...] = (("left", "right"), ("lft", "rgt"), ("l", "r"), ("左", "右"))
"""Words for left and right."""
WORDS, LETTERS = SIDE_WORDS[0], SIDE_WORDS[2]


@dataclass(frozen=True, slots=True)
class NamingProfile:
    """Naming convention of one family of skeletons.

    `side_words` are the convention's own words for left and right, which decide between profiles with the same names;
    `trunk_patterns` maps H-Anim joints to patterns, `limb_patterns` H-Anim joints without "l_" or "r_".
    """

    name: str
    side_words: tuple[str, str]
    trunk_patterns: dict[str, str]
    limb_patterns: dict[str, str]
    marker: str = ""


def _limb_profile(
    name: str, sides: tuple[str, str], root: str, head: str, limbs: str, marker: str = ""
) -> NamingProfile:
    """Return a profile from seven `limbs` patterns in the order of `LIMB_JOINT_NAMES`."""
    patterns = dict(zip(LIMB_JOINT_NAMES, limbs.split(), strict=True))
    return NamingProfile(name, sides, {"humanoid_root": root, "skullbase": head}, patterns, marker)


_HANIM_TRUNK = {"humanoid_root": "humanoidroot", "sacroiliac": "sacroiliac", "vl5": "vl5", "skullbase": "skullbase"}
_MOTIONBUILDER = "upleg leg foot toebase arm forearm hand"
_UNREAL = "thigh calf foot ball|toe0|toebase upperarm lowerarm|forearm hand"

PROFILES: tuple[NamingProfile, ...] = (
    NamingProfile("H-Anim 1", LETTERS, _HANIM_TRUNK, {joint: joint for joint in LIMB_JOINT_NAMES}),
    NamingProfile(
        "H-Anim 2",
        LETTERS,
        _HANIM_TRUNK,
        {
            "hip": "hip",
            "knee": "knee",
            "ankle": "talocrural",
            "midtarsal": "|".join(f"metatarsophalangeal{toe}" for toe in ("", 2, 3, 1)),
            "shoulder": "shoulder",
            "elbow": "elbow",
            "wrist": "radiocarpal",
        },
    ),
    _limb_profile("MotionBuilder", WORDS, "hips", "head", _MOTIONBUILDER),
    _limb_profile("CMU (cgspeed)", WORDS, "hips", "head", _MOTIONBUILDER, marker="[lr]hipjoint|lowerback"),
    _limb_profile("Mixamo", WORDS, "hips", "head", _MOTIONBUILDER, marker=r"mixamorig\d*hips|headtopend|lefttoeend"),
    _limb_profile("LAFAN", WORDS, "hips", "head", "upleg leg foot toe arm forearm hand"),
    _limb_profile(
        "Perception Neuron",
        WORDS,
        "hips",
        "head",
        "upleg leg foot toes arm forearm hand",
        marker="leftinhandindex|leftinhandmiddle|robotlefthand",
    ),
    _limb_profile("SOMA (BONES-SEED)", WORDS, "hips", "head", "leg shin foot toebase arm forearm hand"),
    _limb_profile("Rokoko", WORDS, "hips|hip", "head", "thigh shin foot toe arm|upperarm forearm hand"),
    _limb_profile("Xsens", WORDS, "pelvis", "head", "upperleg lowerleg foot toe upperarm forearm hand"),
    _limb_profile(
        "Biovision (Xsens BVH, OptiTrack)",
        WORDS,
        "hips|hip",
        "head",
        "hip knee ankle|foot toe|toes|toebase shoulder elbow wrist|hand",
    ),
    _limb_profile("MocapNET", LETTERS, "hip|hips", "head", "hip knee ankle|foot toe|toes shoulder elbow wrist|hand"),
    _limb_profile("OptiTrack Motive", LETTERS, "hip|hips", "head", "thigh shin foot toe uarm farm hand"),
    _limb_profile("3ds Max Biped", LETTERS, "pelvis", "head", "thigh calf foot toe0 upperarm forearm hand"),
    _limb_profile(
        "Blender",
        LETTERS,
        "hips|spine|pelvis|torso",
        "head|spine006",
        "thigh shin foot toe upperarm forearm hand",
    ),
    _limb_profile("Unreal", LETTERS, "pelvis", "head", _UNREAL),
    _limb_profile(
        "Character Creator",
        LETTERS,
        "hip|pelvis",
        "head",
        "thigh calf foot toebase upperarm forearm hand",
        marker="ccbase.*",
    ),
    _limb_profile("VRM", WORDS, "hips", "head", "upperleg lowerleg foot toes upperarm lowerarm hand"),
    _limb_profile(
        "Bandai-Namco",
        LETTERS,
        "hips",
        "head",
        "upperleg lowerleg foot toes upperarm lowerarm hand",
        marker="jointroot",
    ),
    _limb_profile("VRM (VRoid)", LETTERS, "chips", "chead", "upperleg lowerleg foot toebase upperarm lowerarm hand"),
    _limb_profile("Poser", LETTERS, "hip", "head", "thigh|buttock shin foot toe shldr forearm hand"),
    _limb_profile(
        "Daz",
        LETTERS,
        "hip",
        "head",
        "thighbend|thigh shin foot toe|toes|metatarsals shldrbend|upperarm forearmbend|forearm hand",
        marker=".*(thighbend|metatarsals).*",
    ),
    _limb_profile(
        "SMPL",
        WORDS,
        "pelvis|root",
        "head|upperneck",
        "hip knee ankle|foot foot|toe|toes|toebase shoulder elbow wrist|hand",
    ),
    _limb_profile("mocopi", LETTERS, "root", "head", "upleg lowleg foot toes uparm lowarm hand"),
    _limb_profile("Acclaim", LETTERS, "root", "head", "femur tibia foot toes humerus radius wrist|hand"),
    _limb_profile("Biovision (classic)", WORDS, "hips", "head", "upleg lowleg foot toe uparm lowarm hand"),
    _limb_profile(
        "MakeHuman",
        LETTERS,
        "root|spine05",
        "head",
        "upperleg01 lowerleg01 foot toe21|toe31|toe11 upperarm01 lowerarm01 wrist|hand",
    ),
    _limb_profile(
        "MikuMikuDance",
        SIDE_WORDS[3],
        "下半身|センター|lowerbody|center",
        "頭|head",
        "足|leg ひざ|ヒザ|膝|knee 足首|ankle つま先|toe|足先ex 腕|arm ひじ|ヒジ|肘|elbow 手首|wrist|hand",
    ),
    _limb_profile(
        "common words",
        WORDS,
        "hips|hip|pelvis|root",
        "head",
        "upleg|upperleg|thigh|femur|hip|leg lowleg|lowerleg|shin|calf|tibia|knee|leg ankle|foot "
        "toebase|toe|toes|ball|foot upperarm|uparm|humerus|arm|shoulder "
        "forearm|lowerarm|lowarm|radius|elbow wrist|hand",
    ),
)
