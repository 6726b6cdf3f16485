"""How motion and audio share a line: what each gets, from a narrow line to a wide one (design: base motion first, then
audio, then better motion)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Step(NamedTuple):
    """A way to share a line: the rate of motion, and of what goes with it; that of audio, -1 for none of it; and the
    kbit/s of both."""

    motion: int
    audio: int
    kbps: float


def steps(motion: Sequence[float], audio: Sequence[float] = ()) -> tuple[Step, ...]:
    """The ways to share a line, from the narrowest to the widest: `motion` and `audio` are kbit/s of their rates,
    lowest first, and may be empty.

    First the lowest motion alone, then with the lowest audio; from there on the one goes up whose next rate costs less:
    so that a motion is at its best before the sound gets ten times as much. Without one of them the rates of the other.
    """
    if not motion:
        return tuple(Step(rate, rate, kbps) for rate, kbps in enumerate(audio))
    if not audio:
        return tuple(Step(rate, -1, kbps) for rate, kbps in enumerate(motion))
    found = [Step(0, -1, motion[0]), Step(0, 0, motion[0] + audio[0])]
    while (at := found[-1])[:2] != (len(motion) - 1, len(audio) - 1):
        moved = motion[at.motion + 1] - motion[at.motion] if at.motion + 1 < len(motion) else float("inf")
        heard = audio[at.audio + 1] - audio[at.audio] if at.audio + 1 < len(audio) else float("inf")
        up = (at.motion + 1, at.audio) if moved <= heard else (at.motion, at.audio + 1)
        found.append(Step(*up, motion[up[0]] + audio[up[1]]))
    return tuple(found)


def first_step(shares: Sequence[Step]) -> int:
    """Where to begin with an unknown line: at the widest without audio, else at the widest with audio at its lowest."""
    return max((n for n, step in enumerate(shares) if step.audio <= 0), default=0)


def safe_step(shares: Sequence[Step]) -> int:
    """What one who does not look is sent: the narrowest that can be heard, if any can."""
    return next((n for n, step in enumerate(shares) if step.audio >= 0), 0)


def pinned(shares: Sequence[Step], rate: int | None) -> tuple[Step, ...]:
    """The steps with the motion at `rate`, kept within its rates; all of them where none is asked for."""
    if rate is None:
        return tuple(shares)
    kept = min(max(rate, 0), shares[-1].motion)
    return tuple(step for step in shares if step.motion == kept)
