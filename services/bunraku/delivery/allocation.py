"""Allocation of a link's bandwidth to motion and audio: base motion first, then audio, then better motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class BitrateAllocation(NamedTuple):
    """Levels of motion and audio, and their bitrate together."""

    motion_level: int
    """Level of the motion, and of cameras and lights."""
    audio_level: int
    """Level of the audio, -1 for no audio."""
    kbps: float


def build_allocations(motion_kbps: Sequence[float], audio_kbps: Sequence[float] = ()) -> tuple[BitrateAllocation, ...]:
    """Return the allocations, from the lowest bitrate to the highest.

    The arguments are the bitrates of the levels in kbit/s, lowest first; either may be empty. The first allocation is
    the lowest motion alone, the second adds the lowest audio. Each further one raises the level that costs less to
    raise, so that the motion reaches its best level before audio gets ten times as much.
    """
    if not motion_kbps:
        return tuple(BitrateAllocation(level, level, kbps) for level, kbps in enumerate(audio_kbps))
    if not audio_kbps:
        return tuple(BitrateAllocation(level, -1, kbps) for level, kbps in enumerate(motion_kbps))
    found = [BitrateAllocation(0, -1, motion_kbps[0]), BitrateAllocation(0, 0, motion_kbps[0] + audio_kbps[0])]
    while (at := found[-1])[:2] != (len(motion_kbps) - 1, len(audio_kbps) - 1):
        motion_cost = (
            motion_kbps[at.motion_level + 1] - motion_kbps[at.motion_level]
            if at.motion_level + 1 < len(motion_kbps)
            else float("inf")
        )
        audio_cost = (
            audio_kbps[at.audio_level + 1] - audio_kbps[at.audio_level]
            if at.audio_level + 1 < len(audio_kbps)
            else float("inf")
        )
        raised = (
            (at.motion_level + 1, at.audio_level)
            if motion_cost <= audio_cost
            else (at.motion_level, at.audio_level + 1)
        )
        found.append(BitrateAllocation(*raised, motion_kbps[raised[0]] + audio_kbps[raised[1]]))
    return tuple(found)


def initial_index(allocations: Sequence[BitrateAllocation]) -> int:
    """Return the index to start with: the highest motion, with audio at its lowest level if there is any."""
    return max((n for n, step in enumerate(allocations) if step.audio_level <= 0), default=0)


def fallback_index(allocations: Sequence[BitrateAllocation]) -> int:
    """Return the index for a page in the background: the lowest with audio, if there is any."""
    return next((n for n, step in enumerate(allocations) if step.audio_level >= 0), 0)


def filter_by_motion_level(
    allocations: Sequence[BitrateAllocation], level: int | None
) -> tuple[BitrateAllocation, ...]:
    """Return the allocations with the motion at `level`, clamped to its levels; all of them if `level` is None."""
    if level is None:
        return tuple(allocations)
    clamped = min(max(level, 0), allocations[-1].motion_level)
    return tuple(step for step in allocations if step.motion_level == clamped)
