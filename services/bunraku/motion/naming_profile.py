"""Joint naming conventions of capture and animation programs.

Names are compared without case and everything but letters and digits, after removal of a namespace ("rig:") and a
common prefix ("Character1_"): "upper_arm.L" is `upperarml`. In a pattern `{side}` is the side word, and `|` separates
alternatives. A `marker` is a regular expression on the normalised names that distinguishes a profile from another with
the same names; it does not contribute to the mapping.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NamingProfile:
    """Naming convention of one family of skeletons.

    `side_words` are the words for left and right; `trunk_patterns` maps H-Anim joints to patterns, `limb_patterns`
    H-Anim joints without "l_" or "r_".
    """

    name: str
    side_words: tuple[str, str]
    trunk_patterns: dict[str, str]
    limb_patterns: dict[str, str]
    marker: str = ""


LIMB_JOINT_NAMES = ("hip", "knee", "ankle", "midtarsal", "shoulder", "elbow", "wrist")
SIDE_WORDS = ("left", "right")
SIDE_LETTERS = ("l", "r")


def _limb_profile(
    name: str, sides: tuple[str, str], root: str, head: str, limbs: str, marker: str = ""
) -> NamingProfile:
    """Return a profile from seven `limbs` patterns in the order of `LIMB_JOINT_NAMES`."""
    patterns = dict(zip(LIMB_JOINT_NAMES, limbs.split(), strict=True))
    return NamingProfile(name, sides, {"humanoid_root": root, "skullbase": head}, patterns, marker)


_MOTIONBUILDER = "{side}upleg {side}leg {side}foot {side}toebase {side}arm {side}forearm {side}hand"

PROFILES: tuple[NamingProfile, ...] = (
    NamingProfile(
        "H-Anim 1",
        SIDE_LETTERS,
        {"humanoid_root": "humanoidroot", "sacroiliac": "sacroiliac", "vl5": "vl5", "skullbase": "skullbase"},
        {joint: "{side}" + joint for joint in LIMB_JOINT_NAMES},
    ),
    NamingProfile(
        "H-Anim 2",
        SIDE_LETTERS,
        {"humanoid_root": "humanoidroot", "sacroiliac": "sacroiliac", "vl5": "vl5", "skullbase": "skullbase"},
        {
            "hip": "{side}hip",
            "knee": "{side}knee",
            "ankle": "{side}talocrural",
            "midtarsal": "|".join(f"{{side}}metatarsophalangeal{toe}" for toe in ("", 2, 3, 1)),
            "shoulder": "{side}shoulder",
            "elbow": "{side}elbow",
            "wrist": "{side}radiocarpal",
        },
    ),
    _limb_profile("MotionBuilder", SIDE_WORDS, "hips", "head", _MOTIONBUILDER),
    _limb_profile("CMU (cgspeed)", SIDE_WORDS, "hips", "head", _MOTIONBUILDER, marker="[lr]hipjoint|lowerback"),
    _limb_profile(
        "Mixamo", SIDE_WORDS, "hips", "head", _MOTIONBUILDER, marker=r"mixamorig\d*hips|headtopend|lefttoeend"
    ),
    _limb_profile(
        "LAFAN",
        SIDE_WORDS,
        "hips",
        "head",
        "{side}upleg {side}leg {side}foot {side}toe {side}arm {side}forearm {side}hand",
    ),
    _limb_profile(
        "Perception Neuron",
        SIDE_WORDS,
        "hips",
        "head",
        "{side}upleg {side}leg {side}foot {side}toes {side}arm {side}forearm {side}hand",
        marker="leftinhandindex|leftinhandmiddle|robotlefthand",
    ),
    _limb_profile(
        "Rokoko",
        SIDE_WORDS,
        "hips|hip",
        "head",
        "{side}thigh {side}shin {side}foot {side}toe {side}arm|{side}upperarm {side}forearm {side}hand",
    ),
    _limb_profile(
        "Xsens",
        SIDE_WORDS,
        "pelvis",
        "head",
        "{side}upperleg {side}lowerleg {side}foot {side}toe {side}upperarm {side}forearm {side}hand",
    ),
    _limb_profile(
        "Biovision (Xsens BVH, OptiTrack)",
        SIDE_WORDS,
        "hips|hip",
        "head",
        "{side}hip {side}knee {side}ankle {side}toe {side}shoulder {side}elbow {side}wrist",
    ),
    _limb_profile(
        "OptiTrack Motive",
        SIDE_LETTERS,
        "hip|hips",
        "head",
        "{side}thigh {side}shin {side}foot {side}toe {side}uarm {side}farm {side}hand",
    ),
    _limb_profile(
        "3ds Max Biped",
        SIDE_LETTERS,
        "pelvis",
        "head",
        "{side}thigh {side}calf {side}foot {side}toe0 {side}upperarm {side}forearm {side}hand",
    ),
    _limb_profile(
        "Blender",
        SIDE_LETTERS,
        "hips|spine|pelvis|torso",
        "head|spine006",
        "thigh{side} shin{side} foot{side} toe{side} upperarm{side} forearm{side} hand{side}",
    ),
    _limb_profile(
        "Unreal",
        SIDE_LETTERS,
        "pelvis",
        "head",
        "thigh{side} calf{side} foot{side} ball{side} upperarm{side} lowerarm{side} hand{side}",
    ),
    _limb_profile(
        "VRM",
        SIDE_WORDS,
        "hips",
        "head",
        "{side}upperleg {side}lowerleg {side}foot {side}toes {side}upperarm {side}lowerarm {side}hand",
    ),
    _limb_profile(
        "VRM (VRoid)",
        SIDE_LETTERS,
        "chips",
        "chead",
        "{side}upperleg {side}lowerleg {side}foot {side}toebase {side}upperarm {side}lowerarm {side}hand",
    ),
    _limb_profile(
        "Poser",
        SIDE_LETTERS,
        "hip",
        "head",
        "{side}thigh|{side}buttock {side}shin {side}foot {side}toe {side}shldr {side}forearm {side}hand",
    ),
    _limb_profile(
        "Daz",
        SIDE_LETTERS,
        "hip",
        "head",
        "{side}thighbend {side}shin {side}foot {side}toe {side}shldrbend {side}forearmbend {side}hand",
    ),
    _limb_profile(
        "SMPL",
        SIDE_WORDS,
        "pelvis|root",
        "head",
        "{side}hip {side}knee {side}ankle {side}foot {side}shoulder {side}elbow {side}wrist",
    ),
    _limb_profile(
        "SMPL (letters)",
        SIDE_LETTERS,
        "pelvis",
        "head",
        "{side}hip {side}knee {side}ankle {side}foot {side}shoulder {side}elbow {side}wrist",
    ),
    _limb_profile(
        "Acclaim",
        SIDE_LETTERS,
        "root",
        "head",
        "{side}femur {side}tibia {side}foot {side}toes {side}humerus {side}radius {side}wrist|{side}hand",
    ),
    _limb_profile(
        "Biovision (classic)",
        SIDE_WORDS,
        "hips",
        "head",
        "{side}upleg {side}lowleg {side}foot {side}toe {side}uparm {side}lowarm {side}hand",
    ),
)
