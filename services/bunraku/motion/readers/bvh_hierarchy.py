"""Hierarchy section of a BVH file: the tree of joints, from HIERARCHY to MOTION."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import EndSite

MAX_JOINTS = 1_000
MAX_DEPTH = 256
MAX_NAME_BYTES = 200
MAX_LENGTH = 1e12
"""Largest offset or position, in any unit: products of larger ones would overflow."""
CUT_SHORT_HINT = "the file may be cut short; export it again"
AXES = "xyz"
ORIGIN = (0.0, 0.0, 0.0)
CHANNEL_NAMES = {
    f"{axis}{kind}": f"{axis.upper()}{kind}" for kind in ("position", "rotation", "scale") for axis in AXES
}

_SEPARATOR = re.compile(rb"(?:\s++|(?:#|//)[^\n]*+)*+")
_WORD = re.compile(rb"[{}]|[^\s{}]+")
_NAME = re.compile(rb"[^\n{}]*")
_DECIMAL_COMMA = re.compile(rb"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """Joints as in `bvh.Bvh`; `motion_start` is the byte after the word MOTION and `motion_line` its line."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    channels: tuple[tuple[str, ...], ...]
    joint_lines: tuple[int, ...]
    ends: tuple[EndSite, ...]
    notes: tuple[str, ...]
    motion_start: int
    motion_line: int


@dataclass(slots=True)
class _Tokenizer:
    """Iterator over the words of `text`, with the line of the last one."""

    text: bytes
    position: int = 0
    line: int = 1

    def skip_separators(self) -> None:
        """Skip space, blank lines and comments (# or //)."""
        if between := _SEPARATOR.match(self.text, self.position):
            self.line += self.text.count(b"\n", self.position, between.end())
            self.position = between.end()

    def peek(self) -> bytes:
        """Return the next word without consuming it; empty at the end of the file."""
        self.skip_separators()
        word = _WORD.match(self.text, self.position)
        return word.group() if word else b""

    def next_token(self) -> bytes:
        """Consume and return the next word; empty at the end of the file."""
        word = self.peek()
        self.position += len(word)
        return word

    def next_name(self) -> bytes:
        """Consume the rest of the line up to a brace, stripped: names may contain spaces."""
        rest = _NAME.match(self.text, self.position)
        name = rest.group().strip() if rest else b""
        if len(name) > MAX_NAME_BYTES:
            raise UnreadableFile(
                "Name too long",
                f"the name {quote_excerpt(name)} has over {MAX_NAME_BYTES} bytes",
                line=self.line,
                hint="shorten it, or begin a new line after it",
            )
        self.position = rest.end() if rest else self.position
        return name


@dataclass(slots=True)
class _HierarchyBuilder:
    """Joints parsed so far; `stack` is the path from the root to the open brace, None for an End Site.

    `offsets`, `channels` and the offsets of `ends` are None until the file declares them.
    """

    names: list[bytes] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[tuple[float, float, float] | None] = field(default_factory=list)
    channels: list[tuple[str, ...] | None] = field(default_factory=list)
    joint_lines: list[int] = field(default_factory=list)
    ends: list[tuple[int, tuple[float, float, float] | None]] = field(default_factory=list)
    stack: list[int | None] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def parse_hierarchy(text: bytes) -> Hierarchy:
    """Parse the joints of the BVH file `text` (line feeds only, ASCII-compatible). Raises `UnreadableFile`."""
    words = _Tokenizer(text)
    tree = _HierarchyBuilder()
    first = words.peek().lower()
    if first == b"hierarchy":
        words.next_token()
    elif first != b"root":
        raise UnreadableFile(
            "Not a BVH file",
            f"it begins with {quote_excerpt(words.peek())}",
            line=words.line,
            hint="a BVH file begins with the word HIERARCHY; export the motion as BVH",
        )
    while True:
        word = words.next_token()
        line = words.line
        match word.lower():
            case b"root":
                _parse_root(tree, words)
            case b"joint":
                _parse_joint(tree, words)
            case b"end" | b"endsite":
                _parse_end_site(tree, words)
            case b"offset":
                _parse_offset(tree, words)
            case b"channels":
                _parse_channels(tree, words)
            case b"}":
                if not tree.stack:
                    raise UnreadableFile(
                        "Unbalanced braces", "this } closes nothing", line=line, hint="remove it or add the missing {"
                    )
                tree.stack.pop()
            case b"motion":
                break
            case b"":
                raise UnreadableFile(
                    "No motion", "the file ends before the word MOTION", line=line, hint="the file may be cut short"
                )
            case _:
                raise UnreadableFile(
                    "Unknown word",
                    f"{quote_excerpt(word)} is not part of a BVH hierarchy",
                    line=line,
                    hint="expected JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION",
                )
    if tree.stack:
        open_joint = next((joint for joint in reversed(tree.stack) if joint is not None), 0)
        raise UnreadableFile(
            "Unbalanced braces",
            f"{len(tree.stack)} braces are still open at MOTION",
            line=words.line,
            field=_decode_names(tree.names)[open_joint],
            hint="add the missing }",
        )
    if not tree.names:
        raise UnreadableFile("No joints", "the hierarchy has no ROOT", line=words.line, hint="export a skeleton")
    names = _decode_names(tree.names)
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        tree.notes.append(f"Several joints have the same name: {', '.join(repeated[:5])}.")
    return Hierarchy(
        names=names,
        parents=tuple(tree.parents),
        offsets=np.array([offset or ORIGIN for offset in tree.offsets]),
        channels=tuple(channels or () for channels in tree.channels),
        joint_lines=tuple(tree.joint_lines),
        ends=tuple(EndSite(parent, np.array(offset or ORIGIN)) for parent, offset in tree.ends),
        notes=tuple(tree.notes),
        motion_start=words.position,
        motion_line=words.line,
    )


def _parse_root(builder: _HierarchyBuilder, tokens: _Tokenizer) -> None:
    if builder.names:
        raise UnreadableFile(
            "Two roots",
            "a second ROOT begins here",
            line=tokens.line,
            field=_decode_names([tokens.next_name()])[0],
            hint="send one figure a file",
        )
    _open_joint(builder, tokens, -1)


def _parse_joint(builder: _HierarchyBuilder, tokens: _Tokenizer) -> None:
    line = tokens.line
    if not builder.stack or builder.stack[-1] is None:
        inside = "an End Site" if builder.stack else "no joint"
        raise UnreadableFile(
            "Joint in the wrong place",
            f"this joint is inside {inside}",
            line=line,
            field=_decode_names([tokens.next_name()])[0],
            hint="every JOINT belongs between the braces of its parent; check the braces above",
        )
    _open_joint(builder, tokens, builder.stack[-1])


def _open_joint(builder: _HierarchyBuilder, tokens: _Tokenizer, parent: int) -> None:
    """Append a joint below `parent` and open its brace."""
    line = tokens.line
    if len(builder.names) >= MAX_JOINTS:
        raise UnreadableFile(
            "Too many joints", f"over {MAX_JOINTS:,} joints", line=line, hint="export the body's joints only"
        )
    if len(builder.stack) >= MAX_DEPTH:
        raise UnreadableFile(
            "Too deep", f"joints nested over {MAX_DEPTH} deep", line=line, hint="a } may be missing above"
        )
    name = tokens.next_name() or f"joint {len(builder.names)}".encode()
    _expect_open_brace(tokens, name)
    builder.stack.append(len(builder.names))
    builder.names.append(name)
    builder.parents.append(parent)
    builder.offsets.append(None)
    builder.channels.append(None)
    builder.joint_lines.append(line)


def _parse_end_site(builder: _HierarchyBuilder, tokens: _Tokenizer) -> None:
    line = tokens.line
    name = tokens.next_name()
    if not builder.stack or builder.stack[-1] is None:
        raise UnreadableFile(
            "End Site in the wrong place",
            "this End Site belongs to no joint",
            line=line,
            hint="an End Site stands inside the last joint of a chain; check the braces above",
        )
    if len(builder.ends) >= MAX_JOINTS:
        raise UnreadableFile(
            "Too many End Sites", f"over {MAX_JOINTS:,} of them", line=line, hint="export the body's joints only"
        )
    _expect_open_brace(tokens, name)
    builder.ends.append((builder.stack[-1], None))
    builder.stack.append(None)


def _expect_open_brace(tokens: _Tokenizer, name: bytes) -> None:
    line = tokens.line
    if (word := tokens.next_token()) != b"{":
        raise UnreadableFile(
            "Missing brace",
            f"no {{ after {quote_excerpt(name)}",
            line=line,
            field=_decode_names([name])[0],
            hint="add the {" if word else CUT_SHORT_HINT,
        )


def _parse_offset(builder: _HierarchyBuilder, tokens: _Tokenizer) -> None:
    if not builder.stack:
        raise UnreadableFile(
            "OFFSET in the wrong place",
            "this OFFSET belongs to no joint",
            line=tokens.line,
            hint="check the braces above",
        )
    line = tokens.line
    joint = builder.stack[-1]
    if (builder.ends[-1][1] if joint is None else builder.offsets[joint]) is not None:
        raise _duplicate_keyword_error("OFFSET", line)
    offset = (_parse_number(tokens, line), _parse_number(tokens, line), _parse_number(tokens, line))
    if joint is None:
        builder.ends[-1] = (builder.ends[-1][0], offset)
    else:
        builder.offsets[joint] = offset


def _duplicate_keyword_error(keyword: str, line: int) -> UnreadableFile:
    return UnreadableFile(
        f"{keyword} twice",
        f"this joint has {keyword} already",
        line=line,
        field=keyword,
        hint="leave one; a JOINT line or a } may be missing above",
    )


def _parse_number(tokens: _Tokenizer, line: int) -> float:
    """Parse the next word of the OFFSET on `line` as a finite number, with a decimal point or comma."""
    word = tokens.next_token()
    plain = word.replace(b",", b".") if _DECIMAL_COMMA.fullmatch(word) else word.rstrip(b",")
    try:
        value = float(plain) if len(plain) <= MAX_NAME_BYTES and b"_" not in plain else math.nan
    except ValueError:
        value = math.nan
    if not abs(value) <= MAX_LENGTH:
        raise UnreadableFile(
            "Not a number",
            f"OFFSET needs three numbers within {MAX_LENGTH:.0e}, not {quote_excerpt(word)}",
            line=line,
            field="OFFSET",
            hint="write the three lengths as plain decimal numbers" if word else CUT_SHORT_HINT,
        )
    return value


def _parse_channels(builder: _HierarchyBuilder, tokens: _Tokenizer) -> None:
    line = tokens.line
    joint = builder.stack[-1] if builder.stack else None
    if joint is None:
        raise UnreadableFile(
            "CHANNELS in the wrong place",
            "these CHANNELS belong to no joint",
            line=line,
            hint="only joints have channels",
        )
    if builder.channels[joint] is not None:
        raise _duplicate_keyword_error("CHANNELS", line)
    word = tokens.next_token()
    if not word.isdigit() or len(word) > 3:
        raise UnreadableFile(
            "Not a number",
            f"CHANNELS needs a count, not {quote_excerpt(word)}",
            line=line,
            field="CHANNELS",
            hint="write how many channels follow" if word else CUT_SHORT_HINT,
        )
    count = int(word)
    found: list[str] = []
    while name := CHANNEL_NAMES.get(tokens.peek()[:10].decode("latin-1").lower()):
        tokens.next_token()
        found.append(name)
    if len(found) != count:
        following = tokens.peek().lower()
        known = following in (b"", b"{", b"}", b"joint", b"end", b"offset", b"channels", b"motion")
        detail = f"CHANNELS says {count}, but {len(found)} follow" + (
            "" if known else f", then {quote_excerpt(following)}"
        )
        raise UnreadableFile(
            "Wrong number of channels",
            detail,
            line=line,
            field=_decode_names(builder.names)[joint],
            hint="name as many of Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation as it counts",
        )
    if len(set(found)) != len(found):
        raise UnreadableFile(
            "Channel named twice",
            "a joint has each channel once at most",
            line=line,
            field=_decode_names(builder.names)[joint],
            hint="name each channel once",
        )
    builder.channels[joint] = tuple(found)


def _decode_names(names: list[bytes]) -> tuple[str, ...]:
    """Decode names as UTF-8 if all of them are valid, else as Latin-1."""
    try:
        return tuple(name.decode("utf-8") for name in names)
    except UnicodeDecodeError:
        return tuple(name.decode("latin-1") for name in names)
