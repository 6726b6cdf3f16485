"""How motion and audio share a line: what each gets, from a narrow line to a wide one (design: base motion first, then
audio, then better motion)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class BitrateAllocation(NamedTuple):
    """A way to share a line: the rate of motion, and of what goes with it; that of audio, -1 for none of it; and the
    kbit/s of both."""

    motion_level: int
    audio_level: int
    kbps: float


def build_allocations(motion_kbps: Sequence[float], audio_kbps: Sequence[float] = ()) -> tuple[BitrateAllocation, ...]:
    """The ways to share a line, from the narrowest to the widest: `motion` and `audio` are kbit/s of their rates,
    lowest first, and may be empty.

    First the lowest motion alone, then with the lowest audio; from there on the one goes up whose next rate costs less:
    so that a motion is at its best before the sound gets ten times as much. Without one of them the rates of the other.
    """
    if not motion_kbps:
        return tuple(BitrateAllocation(rate, rate, kbps) for rate, kbps in enumerate(audio_kbps))
    if not audio_kbps:
        return tuple(BitrateAllocation(rate, -1, kbps) for rate, kbps in enumerate(motion_kbps))
    found = [BitrateAllocation(0, -1, motion_kbps[0]), BitrateAllocation(0, 0, motion_kbps[0] + audio_kbps[0])]
    while (at := found[-1])[:2] != (len(motion_kbps) - 1, len(audio_kbps) - 1):
        moved = (
            motion_kbps[at.motion_level + 1] - motion_kbps[at.motion_level]
            if at.motion_level + 1 < len(motion_kbps)
            else float("inf")
        )
        heard = (
            audio_kbps[at.audio_level + 1] - audio_kbps[at.audio_level]
            if at.audio_level + 1 < len(audio_kbps)
            else float("inf")
        )
        up = (at.motion_level + 1, at.audio_level) if moved <= heard else (at.motion_level, at.audio_level + 1)
        found.append(BitrateAllocation(*up, motion_kbps[up[0]] + audio_kbps[up[1]]))
    return tuple(found)


def initial_index(allocations: Sequence[BitrateAllocation]) -> int:
    """Where to begin with an unknown line: at the widest without audio, else at the widest with audio at its lowest."""
    return max((n for n, step in enumerate(allocations) if step.audio_level <= 0), default=0)


def fallback_index(allocations: Sequence[BitrateAllocation]) -> int:
    """What one who does not look is sent: the narrowest that can be heard, if any can."""
    return next((n for n, step in enumerate(allocations) if step.audio_level >= 0), 0)


def filter_by_motion_level(
    allocations: Sequence[BitrateAllocation], level: int | None
) -> tuple[BitrateAllocation, ...]:
    """The steps with the motion at `rate`, kept within its rates; all of them where none is asked for."""
    if level is None:
        return tuple(allocations)
    kept = min(max(level, 0), allocations[-1].motion_level)
    return tuple(step for step in allocations if step.motion_level == kept)
