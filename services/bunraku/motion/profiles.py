"""How the programs people capture and animate with name the joints of a body.

Names are compared without case and without anything but letters and digits, after a namespace ("rig:") and a common
prefix ("Character1_") are taken off: "upper_arm.L" is `upperarml`. In a pattern `{side}` is the side word, and `|`
parts alternatives. A `sign` is a regular expression on the bare names that tells a profile from one that shares its
names; it adds nothing to the mapping.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Profile:
    """Names of one family of skeletons: `centre` maps H-Anim joints to patterns, `limbs` the H-Anim joint without its
    "l_" or "r_"; `sides` are the words for left and right."""

    name: str
    sides: tuple[str, str]
    centre: dict[str, str]
    limbs: dict[str, str]
    sign: str = ""


LIMB_JOINTS = ("hip", "knee", "ankle", "midtarsal", "shoulder", "elbow", "wrist")
WORDS = ("left", "right")
LETTERS = ("l", "r")


def _profile(name: str, sides: tuple[str, str], root: str, head: str, limbs: str, sign: str = "") -> Profile:
    """A profile whose `limbs` are seven patterns in the order of `LIMB_JOINTS`."""
    patterns = dict(zip(LIMB_JOINTS, limbs.split(), strict=True))
    return Profile(name, sides, {"humanoid_root": root, "skullbase": head}, patterns, sign)


_MOTIONBUILDER = "{side}upleg {side}leg {side}foot {side}toebase {side}arm {side}forearm {side}hand"

PROFILES: tuple[Profile, ...] = (
    Profile(
        "H-Anim 1",
        LETTERS,
        {"humanoid_root": "humanoidroot", "sacroiliac": "sacroiliac", "vl5": "vl5", "skullbase": "skullbase"},
        {joint: "{side}" + joint for joint in LIMB_JOINTS},
    ),
    Profile(
        "H-Anim 2",
        LETTERS,
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
    _profile("MotionBuilder", WORDS, "hips", "head", _MOTIONBUILDER),
    _profile("CMU (cgspeed)", WORDS, "hips", "head", _MOTIONBUILDER, sign="[lr]hipjoint|lowerback"),
    _profile("Mixamo", WORDS, "hips", "head", _MOTIONBUILDER, sign=r"mixamorig\d*hips|headtopend|lefttoeend"),
    _profile(
        "LAFAN",
        WORDS,
        "hips",
        "head",
        "{side}upleg {side}leg {side}foot {side}toe {side}arm {side}forearm {side}hand",
    ),
    _profile(
        "Perception Neuron",
        WORDS,
        "hips",
        "head",
        "{side}upleg {side}leg {side}foot {side}toes {side}arm {side}forearm {side}hand",
        sign="leftinhandindex|leftinhandmiddle|robotlefthand",
    ),
    _profile(
        "Rokoko",
        WORDS,
        "hips|hip",
        "head",
        "{side}thigh {side}shin {side}foot {side}toe {side}arm|{side}upperarm {side}forearm {side}hand",
    ),
    _profile(
        "Xsens",
        WORDS,
        "pelvis",
        "head",
        "{side}upperleg {side}lowerleg {side}foot {side}toe {side}upperarm {side}forearm {side}hand",
    ),
    _profile(
        "Biovision (Xsens BVH, OptiTrack)",
        WORDS,
        "hips|hip",
        "head",
        "{side}hip {side}knee {side}ankle {side}toe {side}shoulder {side}elbow {side}wrist",
    ),
    _profile(
        "OptiTrack Motive",
        LETTERS,
        "hip|hips",
        "head",
        "{side}thigh {side}shin {side}foot {side}toe {side}uarm {side}farm {side}hand",
    ),
    _profile(
        "3ds Max Biped",
        LETTERS,
        "pelvis",
        "head",
        "{side}thigh {side}calf {side}foot {side}toe0 {side}upperarm {side}forearm {side}hand",
    ),
    _profile(
        "Blender",
        LETTERS,
        "hips|spine|pelvis|torso",
        "head|spine006",
        "thigh{side} shin{side} foot{side} toe{side} upperarm{side} forearm{side} hand{side}",
    ),
    _profile(
        "Unreal",
        LETTERS,
        "pelvis",
        "head",
        "thigh{side} calf{side} foot{side} ball{side} upperarm{side} lowerarm{side} hand{side}",
    ),
    _profile(
        "VRM",
        WORDS,
        "hips",
        "head",
        "{side}upperleg {side}lowerleg {side}foot {side}toes {side}upperarm {side}lowerarm {side}hand",
    ),
    _profile(
        "VRM (VRoid)",
        LETTERS,
        "chips",
        "chead",
        "{side}upperleg {side}lowerleg {side}foot {side}toebase {side}upperarm {side}lowerarm {side}hand",
    ),
    _profile(
        "Poser",
        LETTERS,
        "hip",
        "head",
        "{side}thigh|{side}buttock {side}shin {side}foot {side}toe {side}shldr {side}forearm {side}hand",
    ),
    _profile(
        "Daz",
        LETTERS,
        "hip",
        "head",
        "{side}thighbend {side}shin {side}foot {side}toe {side}shldrbend {side}forearmbend {side}hand",
    ),
    _profile(
        "SMPL",
        WORDS,
        "pelvis|root",
        "head",
        "{side}hip {side}knee {side}ankle {side}foot {side}shoulder {side}elbow {side}wrist",
    ),
    _profile(
        "SMPL (letters)",
        LETTERS,
        "pelvis",
        "head",
        "{side}hip {side}knee {side}ankle {side}foot {side}shoulder {side}elbow {side}wrist",
    ),
    _profile(
        "Acclaim",
        LETTERS,
        "root",
        "head",
        "{side}femur {side}tibia {side}foot {side}toes {side}humerus {side}radius {side}wrist|{side}hand",
    ),
    _profile(
        "Biovision (classic)",
        WORDS,
        "hips",
        "head",
        "{side}upleg {side}lowleg {side}foot {side}toe {side}uparm {side}lowarm {side}hand",
    ),
)
