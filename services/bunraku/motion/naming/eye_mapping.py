"""Eyes of a skeleton, by the names of joints below its head ("LeftEye", "eye.L", "J_Adj_L_FaceEye", "l_eyeball_joint").

The page finds those of avatars by the same words (`avatar/face/eye-bones.ts`).
"""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.motion.joint_tree import is_descendant
from bunraku.motion.naming.joint_name import split_words
from bunraku.motion.naming.naming_profile import SIDE_WORDS

_EYE_WORDS = {"eye", "eyeball"}
_AROUND_EYE = {"lid", "lids", "brow", "brows", "lash", "lashes", "upper", "lower", "socket"}
_CONTROLS = {"target", "aim", "look", "ik", "end", "nub", "tip"}
_OTHER_WORDS = _AROUND_EYE | _CONTROLS
"""Words of joints around an eye, which do not turn with it."""
_JAPANESE_EYES = ("左目", "右目")


def map_eyes(names: Sequence[str], parents: Sequence[int], head: int) -> tuple[int, int] | None:
    """Return the joints of the left and the right eye below `head`, None unless both have a name."""
    found: list[int] = []
    for side in range(2):
        eyes = [
            (len(split_words(name)), joint)
            for joint, name in enumerate(names)
            if _is_eye(name, side) and is_descendant(parents, joint, head)
        ]
        if not eyes:
            return None
        # parts of an eye have longer names
        found.append(min(eyes)[1])
    return found[0], found[1]


def _is_eye(name: str, side: int) -> bool:
    """Return whether a name is that of the left (0) or right (1) eye."""
    if _JAPANESE_EYES[side] in name:
        return True
    words = split_words(name)
    whole, sides = "".join(words), {pair[side] for pair in SIDE_WORDS}
    if any(whole in (word + eye, eye + word) for word in sides for eye in _EYE_WORDS):
        return True
    return not _EYE_WORDS.isdisjoint(words) and not sides.isdisjoint(words) and _OTHER_WORDS.isdisjoint(words)
