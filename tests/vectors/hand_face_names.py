"""Names of fingers and expressions: the words that readers of motions and of avatars share, and vectors of both.

`proto/hand_face_names.json` has the words. `hand_face_names.json` among the vectors has names with the expression that
they are, null for none, and hands with the joints of their fingers, from the thumb.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from bunraku.motion.face import EXPRESSIONS
from bunraku.motion.hands import FINGERS
from bunraku.motion.naming import expression_mapping, finger_name
from bunraku.motion.naming.expression_mapping import map_expression_name
from bunraku.motion.naming.finger_mapping import map_fingers
from bunraku.motion.naming.finger_name import parse_finger_name
from bunraku.motion.naming.joint_name import strip_numbers
from tests.motion.naming.finger_samples import HANDS
from tests.motion.naming_samples import build_tree

Change = Callable[[str], str]


def make_document() -> dict[str, Any]:
    """Return the words of both."""
    return {
        "expressions": {
            "suffixes": expression_mapping.SUFFIX_ALIASES,
            "whole": expression_mapping.WHOLE_ALIASES,
        },
        "fingers": {
            "words": finger_name.FINGER_WORDS,
            "mitten": finger_name.MITTEN_FINGER,
            "ordinals": finger_name.ORDINALS,
            "palm": finger_name.PALM_WORDS,
            "last": finger_name.LAST_WORDS,
            "tip": finger_name.TIP_WORDS,
            "middle": finger_name.MIDDLE_WORDS,
            "side": finger_name.SIDE_WORDS,
            "other": finger_name.OTHER_WORDS,
        },
    }


def _words(name: str) -> str:
    """Return a name in camel case as words: "mouth Smile Left"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)


def _side_letter(separator: str) -> Change:
    """Return a function that shortens the side at the end of a name: "mouthSmile_L"."""
    return lambda name: re.sub("(Left|Right)$", lambda side: separator + side[0][0], name)


def _full_width(name: str) -> str:
    return "".join(chr(ord(letter) + 0xFEE0) if "!" <= letter <= "~" else letter for letter in name)


EXPRESSION_CHANGES: tuple[Change, ...] = (
    str,
    str.upper,
    str.lower,
    lambda name: _words(name).lower().replace(" ", "_"),
    _words,
    _side_letter("_"),
    _side_letter("."),
    _side_letter(""),
    lambda name: _side_letter(" ")(name).upper(),
    "blendShape1.{}".format,
    "rig:Face|{}".format,
    "Face_M_K_{}".format,
    "AK_09_{}".format,
    "head-{}".format,
    lambda name: f"face{name[0].upper()}{name[1:]}",
    lambda name: f"CC_Base_{_side_letter('_')(_words(name).replace(' ', '_'))}",
    _full_width,
    # no expressions
    "pre{}".format,
    "{}_old".format,
)
"""Spellings of an expression's name; the last ones are other words."""
NO_EXPRESSIONS = (
    "",
    "...",
    " ",
    "L",
    "left",
    "smile",
    "body_fat",
    "head_a",
    "Fcl_BRW_Joy",
    "Fcl_MTH_Joy",
    "viseme_PP",
    "HideHairBalls",
    "target 0",
    "mouth",
    "jaw",
    "eyeBlinkLeft2",
    "\N{PILE OF POO}",
)
LONG_NAMES = ("x_" * 90 + "jawOpen", "jawOpen" + "_x" * 90, "a_b_c_d_e_f_g_h_i_j_k_l_m_n_mouth_smile_left")
"""Names that are looked at from their end."""


def expression_names() -> Iterator[str]:
    """Yield names of blend shapes: all expressions in some spellings each, all aliases, and others."""
    for number, name in enumerate(EXPRESSIONS):
        for place, change in enumerate(EXPRESSION_CHANGES):
            if place == 0 or (number + place) % 3 == 0:
                yield change(name)
    for alias in (*expression_mapping.SUFFIX_ALIASES, *expression_mapping.WHOLE_ALIASES):
        yield from (alias, f"Mesh.{alias}", f"x_{alias}")
    yield from (
        "Fcl_EYE_Close_R",
        "Face.M_F00_000_00_Fcl_ALL_Joy",
        "Eye_L_Look_R",
        "Brow_Drop_R",
        "Mouth_Roll_In_Upper",
        "UpperLipUp_Left",
        "vrc.v_ou",
        "blendShape16.vrc_blink",
        "viseme_aa",
        "mouth_smile.L",
        "ns:Face.cheek-puff",
    )
    yield from (*NO_EXPRESSIONS, *LONG_NAMES)


HAND_CHANGES: tuple[tuple[str, Change], ...] = (
    ("", str),
    (", in capitals", str.upper),
    (", with a namespace", "rig:{}".format),
    (", with points", lambda name: name.replace("_", ".")),
    (", numbered", "{}_042".format),
    (", with a prefix", "Armature_{}".format),
)
OTHER_HANDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("no fingers", ("LeftHand,LeftHandEnd", "LeftHand,sword,sword_tip", "LeftHand,ring_prop", "LeftHand,LeftHandPalm")),
    ("a mitten", ("hand_l,thumb_01_l,thumb_02_l", "hand_l,mitten_01_l,mitten_02_l")),
    ("fingers of one joint", ("hand,thumb", "hand,pointer", "hand,mid", "hand,ring", "hand,small")),
    ("forefinger", ("hand,ForeFinger1,ForeFinger2", "hand,fore_finger_b")),
    ("twists and rolls", ("hand,index_01,index_02,index_twist", "hand,ring_roll,ring_01")),
    ("more joints than a finger has", ("hand,index0,index1,index2,index3,index4,index5",)),
    ("three fingers of VRChat", ("hand,Thumb0_L,Thumb1_L,Thumb2_L", "hand,IndexFinger1_L", "hand,LittleFinger1_L")),
    ("numbers from 1 beside a thumb", ("hand,Thumb1", "hand,Finger1_1", "hand,Finger2_1", "hand,Finger3_1")),
    ("Japanese", ("左手首,左人差し指１,左人差し指２", "左手首,左小指１")),
    ("two chains of one finger", ("hand,index_a", "hand,index_b,index_c")),
)


def hands() -> Iterator[tuple[str, list[str], list[int]]]:
    """Yield hands as (reason, names, parents); the wrist is joint 0."""
    for number, (program, sample) in enumerate(HANDS.items()):
        names, parents = build_tree(*sample.chains)
        for place, (suffix, change) in enumerate(HAND_CHANGES):
            changed = [change(name) for name in names]
            # without names, the shape of the hand would decide
            is_named = any(map(parse_finger_name, strip_numbers(changed) or changed))
            if is_named and (place == 0 or (number + place) % 2 == 0):
                yield program + suffix, changed, parents
    for why, chains in OTHER_HANDS:
        yield why, *build_tree(*chains)


def _map_hand(names: list[str], parents: list[int]) -> list[list[int]]:
    """Return the joints of the fingers, by names alone: positions at which no bone lies in the palm."""
    positions = np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            positions[joint] = positions[parent] + [0.03, 0.0, 0.0]
    chains = map_fingers(names, parents, positions, [0, None])[: len(FINGERS)]
    return [list(chain.joints) for chain in chains]


def make_vectors() -> dict[str, Any]:
    """Return names of expressions, and hands with their fingers."""
    return {
        "expressions": {name: map_expression_name(name) for name in expression_names()},
        "hands": [
            {"why": why, "names": names, "parents": parents, "fingers": _map_hand(names, parents)}
            for why, names, parents in hands()
        ],
    }
