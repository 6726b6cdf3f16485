"""Names of joints: their words, their sides, and how the names of one skeleton are spelled."""

from __future__ import annotations

import itertools
import re
import unicodedata
from collections.abc import Container, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from bunraku.motion.joint_tree import is_descendant
from bunraku.motion.naming.naming_profile import SIDE_WORDS, NamingProfile


def normalise_name(name: str) -> str:
    """Return a name without namespace, case and punctuation: "rig:upper_arm.L" -> "upperarml"."""
    return "".join(character for character in _strip_namespace(name).lower() if character.isalnum())


def _strip_namespace(name: str) -> str:
    return re.split(r"[:|]", unicodedata.normalize("NFKC", name).strip().rstrip(":|"))[-1]


def split_words(name: str) -> list[str]:
    """Return the words of a name without namespace, in lower case: "rig:upperArm_01.L" -> upper, arm, 01, l."""
    return [word.lower() for word in _WORD.findall(_strip_namespace(name))]


MIN_NUMBERED_SHARE = 0.8
"""Share of the names of a skeleton from which on numbers at their ends are those of the joints, not of the words."""


def strip_numbers(names: Sequence[str]) -> list[str] | None:
    """Return names without the number of the joint that converters append: "LeftArm_012" -> "LeftArm".

    None if fewer than `MIN_NUMBERED_SHARE` of them have one.
    """
    stripped = [_JOINT_NUMBER.sub("", name) for name in names]
    numbered = sum(short != name for short, name in zip(stripped, names, strict=True))
    return stripped if numbered >= MIN_NUMBERED_SHARE * len(names) > 0 else None


_JOINT_NUMBER = re.compile(r"_[0-9]+$")
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_A-Za-z]+")
_SIDE_MARK = "/"
"""Precedes the side in a key for a name that was divided into side and rest; no normalised name contains it."""


def _split_side(name: str) -> set[tuple[str, str]]:
    """Return the words for a side that are a word of the name, begin or end it, each with the rest of the name."""
    plain, words = normalise_name(name), split_words(name)
    found = set()
    for side in itertools.chain.from_iterable(SIDE_WORDS):
        if plain.startswith(side):
            found.add((side, plain.removeprefix(side)))
        if plain.endswith(side):
            found.add((side, plain.removesuffix(side)))
        if side in words:
            at = words.index(side)
            found.add((side, "".join(words[:at] + words[at + 1 :])))
    return found


class NameIndex:
    """Joints by normalised name, and by side and rest of the name where the name can be divided so."""

    def __init__(self, names: Sequence[str], parents: Sequence[int]) -> None:
        self.parents = parents
        self._joints: dict[str, list[int]] = {}
        for joint, name in enumerate(names):
            self._joints.setdefault(normalise_name(name), []).append(joint)
            for side, rest in _split_side(name):
                self._joints.setdefault(f"{_SIDE_MARK}{side}{_SIDE_MARK}{rest}", []).append(joint)

    def keys_after(self, lead: str) -> list[str]:
        """Return the keys that begin with `lead`, without it; those without a mark if it is empty."""
        if lead:
            return [key.removeprefix(lead) for key in self._joints if key.startswith(lead)]
        return [key for key in self._joints if not key.startswith(_SIDE_MARK)]

    def has_name(self, pattern: str) -> bool:
        """Return whether a regular expression matches a whole key."""
        return any(re.fullmatch(pattern, key) for key in self._joints)

    def find(self, key: str, above: int | None, used: Container[int]) -> int | None:
        """Return the first joint with `key` that is below `above`, if given, and not in `used`; None if none is."""
        for joint in self._joints.get(key, ()):
            if joint not in used and (above is None or is_descendant(self.parents, joint, above)):
                return joint
        return None


class SidePlace(Enum):
    """Place of the side in the names of a skeleton."""

    APART = auto()
    """At the beginning or end, or a separate word in the middle."""
    BEFORE = auto()
    """Directly before a profile's pattern."""
    AFTER = auto()
    """Directly after a profile's pattern."""


@dataclass(frozen=True, slots=True)
class Spelling:
    """Spelling of a skeleton's names: words for the sides and their place, prefix and suffix of all names."""

    words: tuple[str, str]
    place: SidePlace
    prefix: str
    suffix: str

    def limb_key(self, side: int, pattern: str) -> str:
        """Return the key in a `NameIndex` of a pattern on the left (0) or right (1)."""
        lead, core = _key_parts(self.place, self.words[side], pattern)
        return f"{lead}{self.prefix}{core}{self.suffix}"

    def trunk_key(self, pattern: str) -> str:
        """Return the key in a `NameIndex` of a pattern without side."""
        return f"{self.prefix}{pattern}{self.suffix}"


def _key_parts(place: SidePlace, side: str, pattern: str) -> tuple[str, str]:
    """Return what a key begins with, and what follows after the common prefix of all names."""
    match place:
        case SidePlace.APART:
            return f"{_SIDE_MARK}{side}{_SIDE_MARK}", pattern
        case SidePlace.BEFORE:
            return "", side + pattern
        case SidePlace.AFTER:
            return "", pattern + side


MAX_SPELLINGS = 64
"""Spellings that are tried for each profile, those with the shortest prefix and suffix first."""


def find_spellings(profile: NamingProfile, index: NameIndex) -> list[Spelling]:
    """Return the spellings in which a name of the skeleton is the profile's left knee."""
    found: set[Spelling] = set()
    for words, place, pattern in itertools.product(SIDE_WORDS, SidePlace, profile.limb_patterns["knee"].split("|")):
        lead, core = _key_parts(place, words[0], pattern)
        for key in index.keys_after(lead):
            prefix, knee, suffix = key.partition(core)
            if knee:
                found.add(Spelling(words, place, prefix, suffix))
    order = {words: number for number, words in enumerate(SIDE_WORDS)}
    return sorted(
        found,
        key=lambda it: (len(it.prefix + it.suffix), order[it.words], it.place.value, it.prefix, it.suffix),
    )[:MAX_SPELLINGS]
