"""Text of other people that is safe to display: names, problem details, log fields, output of the command line.

`clean_text` is for names at the boundary where they enter; `escape_text` is for output, where the text may come from an
older row or from another server. Both judge characters alike:

- Control characters, surrogates, private-use characters and noncharacters are unsafe.
- So are format characters (Unicode category Cf) and other invisible ones: bidirectional overrides and isolates
  (CVE-2021-42574), zero-width characters, tags, fillers. Joiners are safe where a script needs them (RFC 5892,
  appendix A) and between emoji, and tags in the flags of England, Scotland and Wales (UTS #51, annex C).
- After `MAX_COMBINING_MARKS` combining marks in a row, further ones are unsafe, as is a mark without a base.

Variation selectors are combining marks: emoji and the ideographic variants of Japanese names stay intact.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from typing import Any

MAX_NAME_CHARACTERS = 200
"""Maximum length of the name of a motion or of a file; in UTF-8, a name has at most four times as many bytes."""
MAX_PROBLEM_CHARACTERS = 1_000
"""Maximum length of a text in a problem document or in a reason to close a connection."""
MAX_COMBINING_MARKS = 4
"""Combining marks after one base character; scripts in use need at most as many after normalisation."""

_ZERO_WIDTH_NON_JOINER, _ZERO_WIDTH_JOINER = "\u200c", "\u200d"
_VIRAMA_CLASS = 9
"""Canonical combining class of viramas."""
_UNSAFE_CATEGORIES = frozenset({"Cc", "Cf", "Co", "Cs", "Zl", "Zp"})
_MARK_CATEGORIES = frozenset({"Mn", "Me"})
_SYMBOL_CATEGORIES = frozenset({"So", "Sm", "Sk"})
_INVISIBLE = re.compile(
    # combining grapheme joiner; Hangul fillers; Khmer inherent vowels; unassigned default-ignorable code points;
    # noncharacters; plane 14 except variation selectors
    "[\u034f\u115f\u1160\u17b4\u17b5\u2065\u3164\uffa0\ufff0-\ufff8\ufdd0-\ufdef"
    + "".join(f"{chr(plane << 16 | 0xFFFE)}{chr(plane << 16 | 0xFFFF)}" for plane in range(17))
    + "\U000e0000-\U000e00ff\U000e01f0-\U000effff]"
)
_TAG_FLAG = re.compile("\U0001f3f4(?:" + "|".join(
    "".join(chr(0xE0000 + ord(letter)) for letter in region) for region in ("gbeng", "gbsct", "gbwls")
) + ")\U000e007f")  # fmt: skip
_ESCAPE_SEQUENCE = re.compile(
    # operating system command and other strings up to their terminator; control sequence; other escape (ECMA-48, 5)
    "(?:\x1b[\\]PX^_]|[\x9d\x90\x98\x9e\x9f])[^\x07\x1b\x9c]*(?:\x07|\x1b\\\\|\x9c)?"
    "|(?:\x1b\\[|\x9b)[0-?]*[ -/]*[@-~]?"
    "|\x1b[ -/]*[0-~]?"
)
_SPACES = re.compile("[\t-\r\x85\u2028\u2029 ]+")


def clean_text(text: str, max_characters: int = MAX_NAME_CHARACTERS) -> str:
    """Return `text` without unsafe characters, in Normalization Form C, on one line, trimmed; it may be empty.

    Escape sequences of terminals are removed as a whole. At most `max_characters` characters are kept, and no character
    loses some of its marks or joined parts.
    """
    text = _SPACES.sub(" ", _ESCAPE_SEQUENCE.sub("", text))
    # spaces again, as those around a removed character meet
    safe = _SPACES.sub(" ", "".join(char for char, is_safe in _judge(text) if is_safe))
    return _truncate(unicodedata.normalize("NFC", safe).strip(), max_characters).strip()


def clean_document(value: Any, max_characters: int) -> Any:
    """Return a JSON value with every string in it cleaned as by `clean_text`; keys stay as they are."""
    if isinstance(value, str):
        return clean_text(value, max_characters)
    if isinstance(value, dict):
        return {key: clean_document(item, max_characters) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [clean_document(item, max_characters) for item in value]
    return value


def escape_text(text: str, keep: str = "") -> str:
    r"""Return `text` with unsafe characters as escapes of JSON, such as `\u001b`, except those in `keep`.

    Valid JSON stays valid if `keep` is a line feed: elsewhere unsafe characters occur only inside its strings.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(char if is_safe or char in keep else _escape(char) for char, is_safe in _judge(text))


def _judge(text: str) -> Iterator[tuple[str, bool]]:
    """Yield each character of `text` and whether it is safe to display."""
    flag_ends = {flag.start(): flag.end() for flag in _TAG_FLAG.finditer(text)}
    flag_end = marks = 0
    base = ""
    for index, char in enumerate(text):
        flag_end = flag_ends.get(index, flag_end)
        category = unicodedata.category(char)
        if category in _MARK_CATEGORIES:
            marks += 1
            is_safe = bool(base) and marks <= MAX_COMBINING_MARKS and not _INVISIBLE.match(char)
        elif char in (_ZERO_WIDTH_JOINER, _ZERO_WIDTH_NON_JOINER):
            is_safe = _is_joiner_in_context(char, text[index - 1 : index], base, text[index + 1 : index + 2])
        else:
            is_safe = index < flag_end or not (category in _UNSAFE_CATEGORIES or _INVISIBLE.match(char))
            base, marks = (char if is_safe and category != "Zs" else ""), 0
        yield char, is_safe


def _is_joiner_in_context(joiner: str, before: str, base: str, after: str) -> bool:
    """Return whether a joiner changes how its neighbours look; `base` is the last character that is no mark."""
    if not (before and base and after):
        return False
    if unicodedata.combining(before) == _VIRAMA_CLASS:
        return True
    if joiner == _ZERO_WIDTH_JOINER:
        return _is_emoji(base) and _is_emoji(after)
    return unicodedata.bidirectional(base) == unicodedata.bidirectional(after) == "AL"


def _is_emoji(char: str) -> bool:
    """Return whether a character may be part of an emoji, by an approximation that needs no further tables."""
    return ord(char) > 0x2000 and unicodedata.category(char) in _SYMBOL_CATEGORIES


def _truncate(text: str, max_characters: int) -> str:
    end = min(len(text), max_characters)
    # neither marks, skin tones nor joined parts may be separated from their base
    while 0 < end < len(text) and (_extends_previous(text[end]) or text[end - 1] == _ZERO_WIDTH_JOINER):
        end -= 1
    return text[:end]


def _extends_previous(char: str) -> bool:
    return (
        unicodedata.category(char) in _MARK_CATEGORIES
        or char in (_ZERO_WIDTH_JOINER, _ZERO_WIDTH_NON_JOINER)
        or "\U0001f3fb" <= char <= "\U0001f3ff"
        or "\U000e0020" <= char <= "\U000e007f"
    )


def _escape(char: str) -> str:
    units = char.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[i] << 8 | units[i + 1]:04x}" for i in range(0, len(units), 2))
