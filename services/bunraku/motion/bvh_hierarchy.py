"""The first half of a BVH file: the tree of joints, from HIERARCHY to MOTION."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from bunraku.motion.errors import UnreadableMotion, shown
from bunraku.motion.rotation import Array

JOINT_LIMIT = 1_000
DEPTH_LIMIT = 256
NAME_LIMIT = 200
AXES = "xyz"
ORIGIN = (0.0, 0.0, 0.0)
CHANNEL_NAMES = {f"{axis}{kind}": f"{axis.upper()}{kind}" for kind in ("position", "rotation") for axis in AXES}

_BETWEEN = re.compile(rb"(?:\s++|(?:#|//)[^\n]*+)*+")
_WORD = re.compile(rb"[{}]|[^\s{}]+")
_NAME = re.compile(rb"[^\n{}]*")
_DECIMAL_COMMA = re.compile(rb"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class EndSite:
    """Where the last bone of a chain ends: `offset` (3,) from joint `parent`, in the file's units."""

    parent: int
    offset: Array


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """The joints as in `bvh.Bvh`; `end` is the byte after the word MOTION and `end_line` its line."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    channels: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    ends: tuple[EndSite, ...]
    notes: tuple[str, ...]
    end: int
    end_line: int


@dataclass(slots=True)
class _Words:
    """The words of `text` one after the other, with the line of the last."""

    text: bytes
    position: int = 0
    line: int = 1

    def skip(self) -> None:
        """Go on to the next word, over space, blank lines and comments (# or //)."""
        if between := _BETWEEN.match(self.text, self.position):
            self.line += self.text.count(b"\n", self.position, between.end())
            self.position = between.end()

    def peek(self) -> bytes:
        """The next word, not taken; empty at the end of the file."""
        self.skip()
        word = _WORD.match(self.text, self.position)
        return word.group() if word else b""

    def take(self) -> bytes:
        """The next word; empty at the end of the file."""
        word = self.peek()
        self.position += len(word)
        return word

    def name(self) -> bytes:
        """The rest of the line up to a brace, without the space around it: names may hold spaces."""
        rest = _NAME.match(self.text, self.position)
        name = rest.group().strip() if rest else b""
        if len(name) > NAME_LIMIT:
            raise UnreadableMotion(
                "Name too long",
                f"the name {shown(name)} has over {NAME_LIMIT} bytes",
                line=self.line,
                hint="shorten it, or begin a new line after it",
            )
        self.position = rest.end() if rest else self.position
        return name


@dataclass(slots=True)
class _Tree:
    """What has been read so far; `stack` is the way from the root to the open brace, None for an End Site.

    `offsets`, `channels` and the offsets of `ends` are None until the file gives them.
    """

    names: list[bytes] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[tuple[float, float, float] | None] = field(default_factory=list)
    channels: list[tuple[str, ...] | None] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    ends: list[tuple[int, tuple[float, float, float] | None]] = field(default_factory=list)
    stack: list[int | None] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_hierarchy(text: bytes) -> Hierarchy:
    """The joints of the BVH file `text` (line feeds only, encoding that keeps ASCII)."""
    words = _Words(text)
    tree = _Tree()
    first = words.peek().lower()
    if first == b"hierarchy":
        words.take()
    elif first != b"root":
        raise UnreadableMotion(
            "Not a BVH file",
            f"it begins with {shown(words.peek())}",
            line=words.line,
            hint="a BVH file begins with the word HIERARCHY; export the motion as BVH",
        )
    while True:
        word = words.take()
        line = words.line
        match word.lower():
            case b"root":
                _root(tree, words)
            case b"joint":
                _joint(tree, words)
            case b"end" | b"endsite":
                _end_site(tree, words)
            case b"offset":
                _offset(tree, words)
            case b"channels":
                _channels(tree, words)
            case b"}":
                if not tree.stack:
                    raise UnreadableMotion(
                        "Unbalanced braces", "this } closes nothing", line=line, hint="remove it or add the missing {"
                    )
                tree.stack.pop()
            case b"motion":
                break
            case b"":
                raise UnreadableMotion(
                    "No motion", "the file ends before the word MOTION", line=line, hint="the file may be cut short"
                )
            case _:
                raise UnreadableMotion(
                    "Unknown word",
                    f"{shown(word)} is not part of a BVH hierarchy",
                    line=line,
                    hint="expected JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION",
                )
    if tree.stack:
        open_joint = next((joint for joint in reversed(tree.stack) if joint is not None), 0)
        raise UnreadableMotion(
            "Unbalanced braces",
            f"{len(tree.stack)} braces are still open at MOTION",
            line=words.line,
            field=_decoded(tree.names)[open_joint],
            hint="add the missing }",
        )
    if not tree.names:
        raise UnreadableMotion("No joints", "the hierarchy has no ROOT", line=words.line, hint="export a skeleton")
    names = _decoded(tree.names)
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        tree.notes.append(f"Several joints have the same name: {', '.join(repeated[:5])}.")
    return Hierarchy(
        names=names,
        parents=tuple(tree.parents),
        offsets=np.array([offset or ORIGIN for offset in tree.offsets]),
        channels=tuple(channels or () for channels in tree.channels),
        lines=tuple(tree.lines),
        ends=tuple(EndSite(parent, np.array(offset or ORIGIN)) for parent, offset in tree.ends),
        notes=tuple(tree.notes),
        end=words.position,
        end_line=words.line,
    )


def _root(tree: _Tree, words: _Words) -> None:
    if tree.names:
        raise UnreadableMotion(
            "Two roots",
            "a second ROOT begins here",
            line=words.line,
            field=_decoded([words.name()])[0],
            hint="send one figure a file",
        )
    _add(tree, words, -1)


def _joint(tree: _Tree, words: _Words) -> None:
    line = words.line
    if not tree.stack or tree.stack[-1] is None:
        inside = "an End Site" if tree.stack else "no joint"
        raise UnreadableMotion(
            "Joint in the wrong place",
            f"this joint is inside {inside}",
            line=line,
            field=_decoded([words.name()])[0],
            hint="every JOINT belongs between the braces of its parent; check the braces above",
        )
    _add(tree, words, tree.stack[-1])


def _add(tree: _Tree, words: _Words, parent: int) -> None:
    """Open a joint below `parent`."""
    line = words.line
    if len(tree.names) >= JOINT_LIMIT:
        raise UnreadableMotion(
            "Too many joints", f"over {JOINT_LIMIT:,} joints", line=line, hint="export the body's joints only"
        )
    if len(tree.stack) >= DEPTH_LIMIT:
        raise UnreadableMotion(
            "Too deep", f"joints nested over {DEPTH_LIMIT} deep", line=line, hint="a } may be missing above"
        )
    name = words.name() or f"joint {len(tree.names)}".encode()
    ancestor: int = parent
    while ancestor >= 0:
        if tree.names[ancestor] == name:
            raise UnreadableMotion(
                "Cycle of joints",
                f"{shown(name)} lies inside itself (see line {tree.lines[ancestor]})",
                line=line,
                field=_decoded([name])[0],
                hint="a joint cannot be its own ancestor; rename it or check the braces",
            )
        ancestor = tree.parents[ancestor]
    _brace(words, name)
    tree.stack.append(len(tree.names))
    tree.names.append(name)
    tree.parents.append(parent)
    tree.offsets.append(None)
    tree.channels.append(None)
    tree.lines.append(line)


def _end_site(tree: _Tree, words: _Words) -> None:
    line = words.line
    name = words.name()
    if not tree.stack or tree.stack[-1] is None:
        raise UnreadableMotion(
            "End Site in the wrong place",
            "this End Site belongs to no joint",
            line=line,
            hint="an End Site stands inside the last joint of a chain; check the braces above",
        )
    if len(tree.ends) >= JOINT_LIMIT:
        raise UnreadableMotion(
            "Too many End Sites", f"over {JOINT_LIMIT:,} of them", line=line, hint="export the body's joints only"
        )
    _brace(words, name)
    tree.ends.append((tree.stack[-1], None))
    tree.stack.append(None)


def _brace(words: _Words, name: bytes) -> None:
    line = words.line
    if words.take() != b"{":
        raise UnreadableMotion(
            "Missing brace", f"no {{ after {shown(name)}", line=line, field=_decoded([name])[0], hint="add the {"
        )


def _offset(tree: _Tree, words: _Words) -> None:
    if not tree.stack:
        raise UnreadableMotion(
            "OFFSET in the wrong place", "it belongs to no joint", line=words.line, hint="check the braces above"
        )
    line = words.line
    joint = tree.stack[-1]
    if (tree.ends[-1][1] if joint is None else tree.offsets[joint]) is not None:
        raise _twice("OFFSET", line)
    offset = (_number(words, line), _number(words, line), _number(words, line))
    if joint is None:
        tree.ends[-1] = (tree.ends[-1][0], offset)
    else:
        tree.offsets[joint] = offset


def _twice(keyword: str, line: int) -> UnreadableMotion:
    return UnreadableMotion(
        f"{keyword} twice",
        f"this joint has {keyword} already",
        line=line,
        field=keyword,
        hint="leave one; a JOINT line or a } may be missing above",
    )


def _number(words: _Words, line: int) -> float:
    """The next word, of the OFFSET on `line`, as a finite number; a decimal comma is as good as a point."""
    word = words.take()
    plain = word.replace(b",", b".") if _DECIMAL_COMMA.fullmatch(word) else word.rstrip(b",")
    try:
        value = float(plain) if len(plain) <= NAME_LIMIT and b"_" not in plain else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UnreadableMotion(
            "Not a number",
            f"OFFSET needs three finite numbers, not {shown(word)}",
            line=line,
            field="OFFSET",
            hint="write the three lengths as plain decimal numbers",
        )
    return value


def _channels(tree: _Tree, words: _Words) -> None:
    line = words.line
    joint = tree.stack[-1] if tree.stack else None
    if joint is None:
        raise UnreadableMotion(
            "CHANNELS in the wrong place", "they belong to no joint", line=line, hint="only joints have channels"
        )
    if tree.channels[joint] is not None:
        raise _twice("CHANNELS", line)
    word = words.take()
    if not word.isdigit() or len(word) > 3:
        raise UnreadableMotion(
            "Not a number",
            f"CHANNELS needs a count, not {shown(word)}",
            line=line,
            field="CHANNELS",
            hint="write how many channels follow",
        )
    count = int(word)
    found: list[str] = []
    while name := CHANNEL_NAMES.get(words.peek()[:10].decode("latin-1").lower()):
        words.take()
        found.append(name)
    if len(found) != count:
        following = words.peek().lower()
        known = following in (b"", b"{", b"}", b"joint", b"end", b"offset", b"channels", b"motion")
        detail = f"CHANNELS says {count}, but {len(found)} follow" + ("" if known else f", then {shown(following)}")
        raise UnreadableMotion(
            "Wrong number of channels",
            detail,
            line=line,
            field=_decoded(tree.names)[joint],
            hint="name as many of Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation as it counts",
        )
    if len(set(found)) != len(found):
        raise UnreadableMotion(
            "Channel named twice",
            "a joint has each channel once at most",
            line=line,
            field=_decoded(tree.names)[joint],
            hint="name each channel once",
        )
    tree.channels[joint] = tuple(found)


def _decoded(names: list[bytes]) -> tuple[str, ...]:
    """The names as text: UTF-8 if all of them are, else Latin-1."""
    try:
        return tuple(name.decode("utf-8") for name in names)
    except UnicodeDecodeError:
        return tuple(name.decode("latin-1") for name in names)
