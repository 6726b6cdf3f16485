"""Which block goes to a viewer next, and when (design.md, The line).

The server pushes ahead of the play position: the first block at the lowest rate, so that something moves at once, then
what lies within `AHEAD` at the chosen rate. What a viewer already has is not sent again.
"""

from __future__ import annotations

from bunraku.codec.track import MotionTrack
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import TimelineState

AHEAD = 4_000_000
"""How far ahead of the play position blocks are pushed, microseconds."""
UPGRADE = 500_000
"""A better version of a block that a viewer has is worth sending only if it can still be decoded before it is shown."""


class Pacer:
    """What one viewer has been sent of one motion."""

    def __init__(self, track: MotionTrack, rates: int) -> None:
        if rates < 1:
            raise ValueError("a motion has one rate at least")
        self._track = track
        self._rates = rates
        self._sent: dict[int, int] = {}

    def next(self, state: TimelineState, clock: int, rate: int) -> tuple[int, int] | None:
        """Index and rate of the block to send now, None when enough is on its way.

        A block counts as sent once it was returned. `rate` is the wanted rate, kept within those there are.
        """
        rate = min(max(rate, 0), self._rates - 1)
        position = position_at(state, clock)
        first = self._track.block_at(position)
        if first not in self._sent:
            self._sent[first] = 0
            return first, 0
        for count in range(self._track.blocks):
            index, turn = (first + count) % self._track.blocks, (first + count) // self._track.blocks
            distance = self._track.start_us(index) + turn * self._track.duration_us - position
            if distance > AHEAD or (turn and not state.loop):
                break
            if index not in self._sent or (self._sent[index] < rate and distance > UPGRADE):
                self._sent[index] = rate
                return index, rate
        return None

    def wait(self, state: TimelineState, clock: int) -> int | None:
        """Microseconds until the next block comes within reach, None while nothing moves."""
        if not state.playing:
            return None
        track = self._track
        reach = (position_at(state, clock) + AHEAD) % track.duration_us
        following = track.block_at(reach) + 1
        return (track.start_us(following) if following < track.blocks else track.duration_us) - reach + 1_000
