"""Where in the motion the stage stands at a clock time, and edits of that (SPEC.md, Timeline).

All times are integer microseconds: `clock` on the reference clock, `position` and `duration` in the motion.
"""

from __future__ import annotations

from dataclasses import replace

from bunraku.wire.messages import TimelineState


def start(
    motion: str, duration: int, clock: int, *, position: int = 0, playing: bool = True, loop: bool = True
) -> TimelineState:
    """The first timeline of a stage that stands at `position` at `clock`; raises ValueError without a duration."""
    if duration <= 0:
        raise ValueError("a timeline needs a motion of some length")
    return TimelineState(1, motion, clock, min(max(position, 0), duration), playing, loop, duration)


def position_at(state: TimelineState, clock: int) -> int:
    """The motion time at `clock`, 0..duration; before the timeline begins, where it begins."""
    position = state.position + (max(clock - state.clock, 0) if state.playing else 0)
    if state.loop:
        return position % state.duration
    return min(position, state.duration)


def edit(
    state: TimelineState,
    clock: int,
    *,
    playing: bool | None = None,
    position: int | None = None,
    loop: bool | None = None,
) -> TimelineState:
    """The timeline from `clock` on, changed where something is given; its epoch is the next.

    Playing on from the end of a motion that does not loop starts it again, as a player's button does.
    """
    where = position_at(state, clock) if position is None else min(max(position, 0), state.duration)
    will_loop = state.loop if loop is None else loop
    if playing and not will_loop and where >= state.duration and position is None:
        where = 0
    return replace(
        state,
        epoch=state.epoch + 1,
        clock=clock,
        position=where,
        playing=state.playing if playing is None else playing,
        loop=will_loop,
    )


def change_motion(state: TimelineState, clock: int, motion: str, duration: int) -> TimelineState:
    """The timeline from `clock` on with another motion, from its start."""
    return replace(start(motion, duration, clock, playing=state.playing, loop=state.loop), epoch=state.epoch + 1)


class TimelineHistory:
    """The timeline that holds at a clock time: the newest, or while that lies ahead the one before it."""

    def __init__(self) -> None:
        self._previous: TimelineState | None = None
        self._newest: TimelineState | None = None

    def put(self, state: TimelineState) -> None:
        """Take in a timeline; one of an older epoch than the newest is ignored."""
        if self._newest is None or state.epoch > self._newest.epoch:
            self._previous, self._newest = self._newest, state

    def restart(self) -> None:
        """A new connection: its first timeline counts, whatever its epoch."""
        if self._newest is not None:
            self._newest = replace(self._newest, epoch=-1)

    @property
    def newest(self) -> TimelineState | None:
        """The timeline of the highest epoch."""
        return self._newest

    def at(self, clock: int) -> TimelineState | None:
        """The timeline that holds at `clock`, None where none was put yet."""
        before, newest = self._previous, self._newest
        if newest is not None and before is not None and clock < newest.clock and before.motion == newest.motion:
            return before
        return newest
