"""Names of finger joints, in the words of capture and animation programs.

The page maps the names of avatars by the same words (`proto/hand_face_names.json`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, auto

from bunraku.motion.naming.joint_name import split_words

FINGER_WORDS = (
    "thumb|親|拇",
    "index|pointer|forefinger|fingers|mitten|人差し|人差|人|食",
    "middle|mid|中",
    "ring|薬",
    "little|pinky|pinkie|small|小",
)
"""Words for the fingers, in the order of `hands.FINGERS`."""
MITTEN_FINGER = 1
"""Finger that stands for all where a source has but one."""
ORDINALS = ("first", "second", "third", "fourth", "fifth")
"""Words of Xsens, which numbers the fingers from the thumb."""
PALM_WORDS = "metacarpal|metacarpus|meta|carpal|palm|mc|cmc|inhand"
LAST_WORDS = "distal|dip|dp|ip"
TIP_WORDS = "end|nub|tip|top|site|effector|eff|先"
MIDDLE_WORDS = "proximal|prox|intermediate|inter|medial|mcp|pip|pp|mp"
SIDE_WORDS = "left|right|lft|rgt|l|r|左|右"
OTHER_WORDS = (
    "ik|ctrl|control|master|tweak|target|pole|twist|roll|weapon|sword|gun|prop|attach|attachment|socket|sleeve|nail|"
    "jewel|helper|grip|hair|muscle|collider|physics"
)
"""Words of joints that are near fingers, or named after one, but are none."""

MAX_DIGITS = 4
"""Digits of a number that are read."""

_PARTS = f"{PALM_WORDS}|{LAST_WORDS}|{TIP_WORDS}|{MIDDLE_WORDS}"
_NAMED = re.compile(
    rf"(?:{SIDE_WORDS})?(?P<palm>inhand)?(?:hand)?(?:f|finger)?(?:{'|'.join(f'({words})' for words in FINGER_WORDS)})"
    rf"(?:finger|指)?(?P<part>{_PARTS})?(?:{SIDE_WORDS})?"
)
_NUMBERED = re.compile(rf"(?:{SIDE_WORDS})?(?:hand)?(?:finger|digit|指)")
_HANIM = re.compile("carpometacarpal|metacarpophalangeal|interphalangeal")


class FingerPart(Enum):
    """Part of a hand that a joint's bone is, as its name says."""

    UNKNOWN = auto()
    PALM = auto()
    """Metacarpal bone."""
    LAST = auto()
    """Bone at the end of a finger."""
    TIP = auto()
    """No bone: the end of the last one."""


@dataclass(frozen=True, slots=True)
class FingerName:
    """What the name of a joint says about a finger.

    `finger` is its place in `hands.FINGERS`, None if the name only has the file's own number of it, `number`.
    `joint_number` is the number of the joint in its finger, None if it has none.
    """

    finger: int | None
    number: int | None
    part: FingerPart
    joint_number: int | None


def parse_finger_name(name: str) -> FingerName | None:
    """Return what a name says about a finger, None if it names none. Words for sides do not matter."""
    words = re.sub(r"\bfore finger\b", "forefinger", " ".join(split_words(name))).split()
    if any(re.fullmatch(OTHER_WORDS, word) for word in words):
        return None
    numbers = [_read_number(word) for word in words if word.isdecimal()]
    hanim = next((word for word in words if _HANIM.fullmatch(word)), None)
    if hanim is not None:
        if not numbers or not 1 <= numbers[-1] <= len(FINGER_WORDS):
            return None
        part = FingerPart.PALM if hanim == "carpometacarpal" else _last_or_unknown("distal" in words)
        return FingerName(numbers[-1] - 1, None, part, None)
    part = _find_part(words)
    for place, word in enumerate(words):
        following = [_read_number(each) for each in words[place + 1 :] if each.isdecimal()]
        named = _NAMED.fullmatch(word)
        if named is not None and word != "midcarpal":
            finger = next(index for index, found in enumerate(named.groups()[1:6]) if found)
            own = _find_part([named["palm"] or "", named["part"] or ""])
            return FingerName(finger, None, own if part is FingerPart.UNKNOWN else part, next(iter(following), None))
        if words[place : place + 2] == ["finger", "base"]:
            # CMU: all fingers are one, from the wrist
            return FingerName(MITTEN_FINGER, None, FingerPart.UNKNOWN, None)
        if following and words[place + 1].isdecimal() and _NUMBERED.fullmatch(word):
            return FingerName(None, following[0], part, next(iter(following[1:]), None))
        if word in ORDINALS and re.fullmatch(_PARTS, "".join(words[place + 1 :])):
            return FingerName(ORDINALS.index(word), None, part, None)
    return None


def _find_part(words: list[str]) -> FingerPart:
    """Return the part that the words of a name say; a tip before all, as in "distal_end"."""
    if any(re.fullmatch(TIP_WORDS, word) for word in words):
        return FingerPart.TIP
    if "inhand" in "".join(words) or any(re.fullmatch(PALM_WORDS, word) for word in words):
        return FingerPart.PALM
    return _last_or_unknown(any(re.fullmatch(LAST_WORDS, word) for word in words))


def _read_number(digits: str) -> int:
    return int(digits[:MAX_DIGITS])


def _last_or_unknown(is_last: bool) -> FingerPart:
    return FingerPart.LAST if is_last else FingerPart.UNKNOWN
