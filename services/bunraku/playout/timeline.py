"""Timeline of a stage: mapping of clock time to motion time, and its edits (proto/playback.md, 4.2).

All times are integer microseconds: `clock` of the reference clock, `position` and `duration` of the motion.
"""

from __future__ import annotations

from dataclasses import replace

from bunraku.wire.messages import TimelineState


def start(
    motion: str, duration: int, clock: int, *, position: int = 0, playing: bool = True, loop: bool = True
) -> TimelineState:
    """Return the first timeline, at `position` at `clock`; raise ValueError if `duration` is not positive."""
    if duration <= 0:
        raise ValueError(f"Motion {motion!r} has the length {duration} us, but a timeline needs a positive one")
    return TimelineState(1, motion, clock, min(max(position, 0), duration), playing, loop, duration)


def position_at(state: TimelineState, clock: int) -> int:
    """Return the motion time at `clock`, 0..duration; before the timeline begins, its first position."""
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
    """Return the timeline from `clock` on, with the given changes and the next epoch.

    Playing at the end of a motion that does not loop starts it from the beginning.
    """
    new_position = position_at(state, clock) if position is None else min(max(position, 0), state.duration)
    will_loop = state.loop if loop is None else loop
    if playing and not will_loop and new_position >= state.duration and position is None:
        new_position = 0
    return replace(
        state,
        epoch=state.epoch + 1,
        clock=clock,
        position=new_position,
        playing=state.playing if playing is None else playing,
        loop=will_loop,
    )


def change_motion(state: TimelineState, clock: int, motion: str, duration: int) -> TimelineState:
    """Return the timeline from `clock` on with another motion, from its beginning, and the next epoch."""
    return replace(start(motion, duration, clock, playing=state.playing, loop=state.loop), epoch=state.epoch + 1)


class TimelineHistory:
    """Newest timeline, and the one before it, which applies until the newest begins."""

    def __init__(self) -> None:
        self._previous: TimelineState | None = None
        self._newest: TimelineState | None = None

    def put(self, state: TimelineState) -> None:
        """Add a timeline; one of an epoch that is not newer is ignored."""
        if self._newest is None or state.epoch > self._newest.epoch:
            self._previous, self._newest = self._newest, state

    def restart(self) -> None:
        """Accept the first timeline of a new connection, whatever its epoch."""
        if self._newest is not None:
            self._newest = replace(self._newest, epoch=-1)

    @property
    def newest(self) -> TimelineState | None:
        """Timeline of the highest epoch."""
        return self._newest

    def at(self, clock: int) -> TimelineState | None:
        """Return the timeline that applies at `clock`, None before the first `put`."""
        before, newest = self._previous, self._newest
        if newest is not None and before is not None and clock < newest.clock and before.motion == newest.motion:
            return before
        return newest
