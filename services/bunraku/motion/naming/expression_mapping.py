"""Mapping of blend shapes to the expressions of a face, by their names.

Names of ARKit are found in any case and with any separators, after prefixes ("blendShape1.", "Face_M_K_", namespaces)
and with "_L" and "_R" for left and right. Names of VRM, which are common words, are found only as whole names.
The page maps the names of avatars by the same words (`proto/hand_face_names.json`).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping

import numpy as np

from bunraku.motion.errors import quote_excerpt
from bunraku.motion.face import EXPRESSIONS, MIN_WEIGHT
from bunraku.motion.rotation import Array

MAX_LISTED = 4
"""Unknown names that a sentence lists."""
MAX_NAME_CHARACTERS, MAX_NAME_WORDS = 200, 12
"""Characters and words of a name that are looked at, from its end."""

_FIRST_OF_VRM = EXPRESSIONS.index("happy")
_ARKIT, _WHOLE = EXPRESSIONS[:_FIRST_OF_VRM], EXPRESSIONS[_FIRST_OF_VRM:]
_SIDES = {"l": "left", "r": "right", "left": "left", "right": "right"}
SUFFIX_ALIASES = {
    # Character Creator 4
    "browdropleft": "browDownLeft",
    "browdropright": "browDownRight",
    "browraiseouterleft": "browOuterUpLeft",
    "browraiseouterright": "browOuterUpRight",
    "cheekraiseleft": "cheekSquintLeft",
    "cheekraiseright": "cheekSquintRight",
    "eyellookleft": "eyeLookOutLeft",
    "eyellookright": "eyeLookInLeft",
    "eyellookup": "eyeLookUpLeft",
    "eyellookdown": "eyeLookDownLeft",
    "eyerlookleft": "eyeLookInRight",
    "eyerlookright": "eyeLookOutRight",
    "eyerlookup": "eyeLookUpRight",
    "eyerlookdown": "eyeLookDownRight",
    "mouthdownlowerleft": "mouthLowerDownLeft",
    "mouthdownlowerright": "mouthLowerDownRight",
    "mouthupupperleft": "mouthUpperUpLeft",
    "mouthupupperright": "mouthUpperUpRight",
    "mouthrollinlower": "mouthRollLower",
    "mouthrollinupper": "mouthRollUpper",
    # VRoid
    "fclallneutral": "neutral",
    "fclallangry": "angry",
    "fclallfun": "relaxed",
    "fclalljoy": "happy",
    "fclallsorrow": "sad",
    "fclallsurprised": "surprised",
    "fcleyeclose": "blink",
    "fcleyecloseleft": "blinkLeft",
    "fcleyecloseright": "blinkRight",
    "fclmtha": "aa",
    "fclmthi": "ih",
    "fclmthu": "ou",
    "fclmthe": "ee",
    "fclmtho": "oh",
    # Mixamo
    "browsdownleft": "browDownLeft",
    "browsdownright": "browDownRight",
    "eyeswideleft": "eyeWideLeft",
    "eyeswideright": "eyeWideRight",
    "frownleft": "mouthFrownLeft",
    "frownright": "mouthFrownRight",
    "jawforeward": "jawForward",
    "lowerlipdownleft": "mouthLowerDownLeft",
    "lowerlipdownright": "mouthLowerDownRight",
    "smileleft": "mouthSmileLeft",
    "smileright": "mouthSmileRight",
    "squintleft": "eyeSquintLeft",
    "squintright": "eyeSquintRight",
    "upperlipupleft": "mouthUpperUpLeft",
    "upperlipupright": "mouthUpperUpRight",
}
"""Other names that are as distinct, normalised; the side is the word at the end."""
WHOLE_ALIASES = {
    # both sides of ARKit's, as Ready Player Me has them
    "eyeblink": "blink",
    "eyesclose": "blink",
    "eyesclosed": "blink",
    "mouthopen": "jawOpen",
    "mouthsmile": "happy",
    # VRM 0.x
    "joy": "happy",
    "sorrow": "sad",
    "fun": "relaxed",
    "a": "aa",
    "i": "ih",
    "u": "ou",
    "e": "ee",
    "o": "oh",
    # visemes of Oculus and VRChat
    "visemeaa": "aa",
    "visemee": "ee",
    "visemei": "ih",
    "visemeo": "oh",
    "visemeu": "ou",
    "vaa": "aa",
    "ve": "ee",
    "vih": "ih",
    "voh": "oh",
    "vou": "ou",
    "vrcblink": "blink",
    "vrcvaa": "aa",
    "vrcve": "ee",
    "vrcvee": "ee",
    "vrcvih": "ih",
    "vrcvoh": "oh",
    "vrcvou": "ou",
    # MikuMikuDance
    "あ": "aa",
    "い": "ih",
    "う": "ou",
    "え": "ee",
    "お": "oh",
    "まばたき": "blink",
    "ウィンク": "blinkLeft",
    "ウィンク右": "blinkRight",
}
"""Names that are found only as whole names, or after a namespace, normalised."""


def _suffix_table() -> dict[str, str]:
    """Return expressions by the normalised end of a name, also with "l" and "r" as the side."""
    table = {name.lower(): name for name in _ARKIT} | SUFFIX_ALIASES
    return table | {
        key.removesuffix(side) + side[0]: name
        for key, name in table.items()
        for side in ("left", "right")
        if key.endswith(side)
    }


_BY_SUFFIX = _suffix_table()
_BY_WHOLE = {name.lower(): name for name in _WHOLE} | WHOLE_ALIASES


def map_expression_name(name: str) -> str | None:
    """Return the expression of `face.EXPRESSIONS` that a blend shape shows, by its name; None if it is unknown."""
    plain = unicodedata.normalize("NFKC", name[-MAX_NAME_CHARACTERS:])
    for whole in (plain, re.split(r"[:|.]", plain)[-1]):
        if (found := _BY_WHOLE.get("".join(_split(whole)))) is not None:
            return found
    words = _split(plain)[-MAX_NAME_WORDS:]
    keys = ("".join(words[start:]) for start in range(len(words)))
    return next((_BY_SUFFIX[key] for key in keys if key in _BY_SUFFIX), None)


_SEPARATOR = re.compile(r"[\W_]+|(?<=[a-z])(?=[A-Z])")


def _split(name: str) -> list[str]:
    """Return the words of a name in lower case, with the side at the end as a whole word."""
    words = [word.lower() for word in _SEPARATOR.split(name) if word]
    if len(words) > 1:
        words[-1] = _SIDES.get(words[-1], words[-1])
    return words


def map_expressions(shapes: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Return the weights (n,) of expressions, and the names of moving blend shapes that are none.

    The largest weight counts of shapes that show the same expression, like those of skin and eyelashes.
    """
    expressions: dict[str, Array] = {}
    unknown: list[str] = []
    for name, weights in shapes.items():
        expression = map_expression_name(name)
        if expression is not None:
            known = expressions.get(expression)
            expressions[expression] = weights if known is None else np.maximum(known, weights)
        elif np.abs(weights).max(initial=0.0) > MIN_WEIGHT:
            unknown.append(name)
    return expressions, unknown


def describe_unknown(names: list[str]) -> str:
    """Return a sentence about blend shapes that were left out."""
    listed = ", ".join(quote_excerpt(name) for name in names[:MAX_LISTED])
    more = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return f"Blend shapes that show no known expression were left out: {listed}{more}."
