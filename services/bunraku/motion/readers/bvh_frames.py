"""Motion section of a BVH file: frame count, frame time and channel values."""

from __future__ import annotations

import math
import re

import numpy as np

from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.readers.bvh_numbers import (
    DECIMAL_COMMA,
    NO_COMMA,
    SEPARATING_COMMA,
    LineStatistics,
    measure_lines,
    parse_numbers,
)
from bunraku.motion.rotation import Array

DEFAULT_FRAME_TIME_S = 1.0 / 30.0
"""Frame time if the file has none."""
MIN_FRAME_TIME_S, MAX_FRAME_TIME_S = 0.001, 10.0
"""Range of a plausible frame time."""

# does not match the # of 1.#QNAN, a broken number
_COMMENT = re.compile(rb"(?<!\S)(?:#|//)[^\n]*")
_DECIMAL = re.compile(rb"(?:\d+[.,]?\d*|[.,]\d+)(?:e[+-]?\d+)?")
_HEADER_FIELD = re.compile(
    rb"\s*(frames|frame[ \t]*time)[ \t]*:?[ \t]*([^\s]*)(?:[ \t]+(?:s|secs?|seconds)\b\.?)?", re.IGNORECASE
)


def parse_frames(text: bytes, start: int, line: int, channel_count: int) -> tuple[Array, float, list[str]]:
    """Return the channel values (n, `channel_count`), the frame time in seconds, and sentences about irregularities.

    `text` is the whole file (line feeds only), `start` the byte after the word MOTION, `line` the line of that word.
    Raises `UnreadableFile`.
    """
    notes: list[str] = []
    if text.find(b"#", start) >= 0 or text.find(b"//", start) >= 0:
        text = text[:start] + _COMMENT.sub(b"", text[start:])
    declared: int | None = None
    frame_time: float | None = None
    position = start
    seen: set[bool] = set()
    while (setting := _HEADER_FIELD.match(text, position)) and (counts := setting[1].lower() == b"frames") not in seen:
        seen.add(counts)
        line += text.count(b"\n", position, setting.end())
        position = setting.end()
        if counts:
            declared = _parse_frame_count(setting[2], notes)
        else:
            frame_time = _parse_frame_time(setting[2], line)
    if frame_time is None or frame_time <= 0.0:
        notes.append(f"The frame time is {'missing' if frame_time is None else 'not above zero'}; 30 frames/s assumed.")
        frame_time = DEFAULT_FRAME_TIME_S
    data = np.frombuffer(text, dtype=np.uint8)[position:]
    comma = _detect_comma_role(text, position)
    lines = measure_lines(data, comma, channel_count)
    values, bad = parse_numbers(data, lines.word_count, comma)
    if bad >= 0:
        raise _invalid_value_error(text, position + bad, line + text.count(b"\n", position, position + bad))
    whole = _count_complete_frames(lines, declared, channel_count, line, notes)
    return values[: whole * channel_count].reshape(whole, channel_count), frame_time, notes


def _parse_frame_count(word: bytes, notes: list[str]) -> int | None:
    if word.isdigit() and len(word) <= 18:
        return int(word)
    notes.append(f"The number of frames is not a number: {quote_excerpt(word)}.")
    return None


def _parse_frame_time(word: bytes, line: int) -> float | None:
    if not word:
        return None
    try:
        seconds = float(word.replace(b",", b".")) if b"_" not in word else math.nan
    except ValueError:
        seconds = math.nan
    if 0.0 < seconds < math.inf and not MIN_FRAME_TIME_S <= seconds <= MAX_FRAME_TIME_S:
        raise UnreadableFile(
            "Frame time out of range",
            f"{quote_excerpt(word)} is not between {MIN_FRAME_TIME_S} and {MAX_FRAME_TIME_S} seconds",
            line=line,
            field="Frame Time",
            hint="write the seconds of one frame, such as 0.0333333",
        )
    if not math.isfinite(seconds):
        raise UnreadableFile(
            "Not a number",
            f"the frame time is {quote_excerpt(word)}",
            line=line,
            field="Frame Time",
            hint="write the seconds of one frame, such as 0.0333333",
        )
    return seconds


def _detect_comma_role(text: bytes, position: int) -> int:
    """Return the role of commas: decimal between digits if the file has no point, else separators."""
    if text.find(b",", position) < 0:
        return NO_COMMA
    if text.find(b".", position) >= 0 or re.compile(rb",\s").search(text, position):
        return SEPARATING_COMMA
    return DECIMAL_COMMA


def _invalid_value_error(text: bytes, position: int, line: int) -> UnreadableFile:
    found = re.compile(rb"\S+").match(text, position)
    word = found.group() if found else b""
    lower = word.lower().lstrip(b"+-")
    if lower.startswith((b"nan", b"inf", b"1.#", b"-1.#")):
        title, hint = "Not a finite number", "the export went wrong in this frame; cut it out or export again"
    elif _DECIMAL.fullmatch(lower):
        title, hint = "Not a finite number", "the number is too large; export again"
    elif lower in (b"hierarchy", b"root", b"motion"):
        title, hint = "Two motions in one file", "send one motion a file"
    else:
        title, hint = "Not a number", "a frame holds decimal numbers only"
    return UnreadableFile(title, f"{quote_excerpt(word)} is not a channel value", line=line, hint=hint)


def _count_complete_frames(
    lines: LineStatistics, declared: int | None, channel_count: int, line: int, notes: list[str]
) -> int:
    """Return the number of complete frames; raise `UnreadableFile` if the values are not frames of `channel_count`.

    `line` is the line of the first frame. Usually each line holds one frame, and every line is checked. If frames share
    lines or span several, only the total is checked.
    """
    if lines.word_count < channel_count:
        raise UnreadableFile(
            "No whole frame",
            f"the channels take {channel_count} values a frame, and there are {lines.word_count} in all",
            line=line,
            hint="the file may be cut short; export it again",
        )
    whole, rest = divmod(lines.word_count, channel_count)
    if odd := _find_inconsistent_line(lines, declared, channel_count):
        raise UnreadableFile(
            "Wrong number of values",
            f"this line has {odd[1]} values, the channels take {channel_count}",
            line=line + odd[0],
            hint="every frame needs one value for each channel; check the CHANNELS lines against the export",
        )
    if rest and (lines.first_mismatch >= 0 or lines.nonblank_lines == 1) and (declared is None or whole >= declared):
        raise UnreadableFile(
            "Wrong number of values",
            f"{lines.word_count:,} values do not divide by the {channel_count} channels",
            line=line + (lines.first_mismatch if lines.first_mismatch >= 0 else lines.last_line),
            hint="every frame needs one value for each channel; check the CHANNELS lines against the export",
        )
    if rest:
        notes.append(f"The last frame has {rest} of {channel_count} values; it was dropped.")
    if declared is None:
        notes.append(f"The number of frames is missing; {whole} are there and were used.")
    elif declared != whole:
        notes.append(f"The file says {declared} frames, but {whole} are there and were used.")
    return whole


def _find_inconsistent_line(lines: LineStatistics, declared: int | None, channel_count: int) -> tuple[int, int] | None:
    """Return the line that contradicts frames of `channel_count` values, and its number of values, or None."""
    rest = lines.word_count % channel_count
    first_odd = (
        (lines.first_mismatch, lines.first_mismatch_words)
        if lines.first_mismatch >= 0
        else (lines.last_line, lines.last_line_words)
    )
    if lines.matching_lines == 0:
        even = lines.nonblank_lines > 1 and lines.min_words == lines.max_words
        return (
            first_odd
            if even and (lines.nonblank_lines == declared or (rest and channel_count % lines.max_words))
            else None
        )
    if lines.first_mismatch >= 0:
        mostly = 2 * lines.matching_lines >= lines.nonblank_lines
        return first_odd if mostly and (rest or lines.word_count // channel_count != declared) else None
    return first_odd if rest and lines.last_line_words > channel_count else None
