"""The second half of a BVH file: the frame count, the frame time and the channel values of every frame."""

from __future__ import annotations

import math
import re

import numpy as np

from bunraku.motion.bvh_numbers import DECIMAL_COMMA, NO_COMMA, SEPARATING_COMMA, parse, words_per_line
from bunraku.motion.errors import UnreadableMotion, shown
from bunraku.motion.rotation import Array

FRAME_TIME = 1.0 / 30.0
"""Seconds a frame, where the file does not say."""

_COMMENT = re.compile(rb"(?:#|//)[^\n]*")
_SETTING = re.compile(rb"\s*(frames|frame[ \t]*time)[ \t]*:?[ \t]*([^\s]*)", re.IGNORECASE)


def read_frames(text: bytes, start: int, line: int, width: int) -> tuple[Array, float, list[str]]:
    """Channel values (n, width), seconds a frame, and sentences on what was not as it should be.

    `text` is the whole file (line feeds only), `start` the byte after the word MOTION, which stands on `line`.
    """
    notes: list[str] = []
    if text.find(b"#", start) >= 0 or text.find(b"//", start) >= 0:
        text = text[:start] + _COMMENT.sub(b"", text[start:])
    declared: int | None = None
    frame_time: float | None = None
    position = start
    while setting := _SETTING.match(text, position):
        position = setting.end()
        at = line + text.count(b"\n", start, setting.start(2))
        if setting.group(1).lower() == b"frames":
            declared = _frame_count(setting.group(2), notes)
        else:
            frame_time = _frame_time(setting.group(2), at)
    line += text.count(b"\n", start, position)
    if frame_time is None or frame_time <= 0.0:
        notes.append(f"The frame time is {'missing' if frame_time is None else 'not above zero'}; 30 frames/s assumed.")
        frame_time = FRAME_TIME
    data = np.frombuffer(text, dtype=np.uint8)[position:]
    comma = _meaning_of_comma(text, position)
    per_line = words_per_line(data, comma)
    values, bad = parse(data, int(per_line.sum()), comma)
    if bad >= 0:
        raise _bad_value(text, position + bad, line + text.count(b"\n", position, position + bad))
    whole = _whole_frames(values, declared, width, per_line, line, notes)
    return values[: whole * width].reshape(whole, width), frame_time, notes


def _frame_count(word: bytes, notes: list[str]) -> int | None:
    if word.isdigit() and len(word) <= 18:
        return int(word)
    notes.append(f"The number of frames is not a number: {shown(word)}.")
    return None


def _frame_time(word: bytes, line: int) -> float | None:
    if not word:
        return None
    try:
        seconds = float(word.replace(b",", b"."))
    except ValueError:
        seconds = math.nan
    if not math.isfinite(seconds):
        raise UnreadableMotion(
            "Not a number",
            f"the frame time is {shown(word)}",
            line=line,
            field="Frame Time",
            hint="write the seconds of one frame, such as 0.0333333",
        )
    return seconds


def _meaning_of_comma(text: bytes, position: int) -> int:
    """Decimal commas stand between digits where no point does; others separate."""
    if text.find(b",", position) < 0:
        return NO_COMMA
    if text.find(b".", position) >= 0 or re.compile(rb",\s").search(text, position):
        return SEPARATING_COMMA
    return DECIMAL_COMMA


def _bad_value(text: bytes, position: int, line: int) -> UnreadableMotion:
    found = re.compile(rb"\S+").match(text, position)
    word = found.group() if found else b""
    lower = word.lower().lstrip(b"+-")
    if lower.startswith((b"nan", b"inf", b"1.#", b"-1.#")):
        title, hint = "Not a finite number", "the export went wrong in this frame; cut it out or export again"
    elif lower in (b"hierarchy", b"root", b"motion"):
        title, hint = "Two motions in one file", "send one motion a file"
    else:
        title, hint = "Not a number", "a frame holds decimal numbers only"
    return UnreadableMotion(title, f"{shown(word)} stands where a channel value should", line=line, hint=hint)


def _whole_frames(
    values: Array, declared: int | None, width: int, per_line: np.ndarray, line: int, notes: list[str]
) -> int:
    """The number of frames in `values`, or a refusal where they cannot be frames of `width` values.

    One frame a line is usual, and then each line is checked. Frames that share lines or run over several are only
    checked in sum.
    """
    total = len(values)
    rows = np.flatnonzero(per_line)
    counts = per_line[rows]
    if total < width:
        raise UnreadableMotion(
            "No whole frame",
            f"the channels take {width} values a frame, and there are {total} in all",
            line=line,
            hint="the file may be cut short; export it again",
        )
    right = counts == width
    if not right.any():
        odd = 0 if len(rows) == declared and (declared > 1 or total % width) and np.ptp(counts) == 0 else None
    elif right.sum() > 0.5 * len(rows) and not right[:-1].all() and (total % width or total // width != declared):
        odd = int(np.argmin(right))
    else:
        odd = len(rows) - 1 if counts[-1] > width and right[:-1].all() and total % width else None
    if odd is not None:
        raise UnreadableMotion(
            "Wrong number of values",
            f"this line has {counts[odd]} values, the channels take {width}",
            line=line + int(rows[odd]),
            hint="every frame needs one value for each channel; check the CHANNELS lines against the export",
        )
    whole, rest = divmod(total, width)
    if rest:
        one_a_line = bool(right[:-1].all())
        if not one_a_line and (declared is None or whole > declared):
            raise UnreadableMotion(
                "Wrong number of values",
                f"{total:,} values do not divide by the {width} channels",
                line=line,
                hint="every frame needs one value for each channel; check the CHANNELS lines against the export",
            )
        notes.append(f"The last frame has {rest} of {width} values; it was dropped.")
    if declared is None:
        notes.append(f"The number of frames is missing; {whole} are there and were used.")
    elif declared != whole:
        notes.append(f"The file says {declared} frames, but {whole} are there and were used.")
    return whole
