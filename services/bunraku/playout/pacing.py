"""Which block goes to a viewer next, and when (design.md, The line).

The server pushes ahead of the play position: the motion's first block at the lowest rate, so that something moves at
once, then the sound at its lowest, the camera and light that go with it, then what lies within `AHEAD` at the chosen
rates, the soonest first and where several are due the motion first, then the sound; last, better versions of what was
sent. What a viewer already has is not sent again.

Over a line that is narrow or may stand for a while the lowest rate goes far ahead as a net, a second of it for the
bytes of a packet's heads, and better versions of what is soon shown just in time: whatever the line does for half a
minute, the dance goes on.

Where there is time for more than the line carries otherwise, what stays on show is bettered first, as the stage stands;
and of a loop all of which is here the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.codec.timing import Timing
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import TimelineState

AHEAD = 4_000_000
"""How far ahead of the play position blocks are pushed, microseconds."""
MARGIN = 1_000
"""So long after a block comes within reach it is looked for, microseconds."""
AFTER = 3_000_000
"""Over a narrow line the motion goes before sound that is heard this much sooner, microseconds."""
NET_AHEAD = 10_000_000
"""As `AHEAD`, for better versions where a net is kept: such a line may stand for seconds."""
SOON = 8_000_000
"""What is shown within this goes though overlays share the line, microseconds."""
SAFE = 15_000_000
"""Nothing is bettered before the net reaches this far, microseconds."""
JUST = 2_000_000
"""What is shown within this is bettered before the rest of the net, microseconds."""
NET = 30_000_000
"""How far ahead of the play position the net reaches, microseconds."""
REFILL = 20_000_000
"""It is filled again when it reaches less far: several small blocks together are one packet."""
UPGRADE = 500_000
"""A better version of a block that a viewer has is worth sending only if it can still be decoded before it is shown."""
AGAIN = AHEAD - 1_000_000
"""The same of sound, but for short motions: it is bettered as it comes within reach once more in a loop. Bettering all
that waits already would fill a line for what is heard once for a few seconds."""


@dataclass(frozen=True, slots=True)
class Paced:
    """A track that is sent: its index in the Description, when its blocks are, and how many rates it has. The blocks of
    a `base` track come first, and the first of them at the lowest rate: the motion's; next to them those of `audio`,
    alike."""

    number: int
    timing: Timing
    rates: int
    base: bool
    audio: bool = False

    @property
    def place(self) -> int:
        """Among the blocks of one instant: the motion's first, then sound, then cameras and lights."""
        return 0 if self.base else 1 if self.audio else 2

    def wanted(self, rate: int, audio: int | None) -> int:
        """Which of `rate` and the rate of sound, where that is another, is this track's; below zero for none."""
        return max(rate, 0) if audio is None or not self.audio else audio


@dataclass(frozen=True, slots=True, order=True)
class Due:
    """A block to be sent, those to be sent first being the least: whether it lies far ahead where a net is kept,
    whether it only betters one that was sent, how long until it is shown in microseconds (of sound over a narrow line
    `AFTER` longer), its place among others of the same instant, and which one it is."""

    far: bool
    better: bool
    distance: int
    place: int
    track: int
    index: int
    rate: int


class Pacer:
    """What one viewer has been sent of one motion's tracks."""

    def __init__(self, tracks: Sequence[Paced]) -> None:
        """Raises ValueError for a track without rates."""
        if any(track.rates < 1 for track in tracks):
            raise ValueError("a track has one rate at least")
        self.tracks = tracks
        """Of others nothing is sent."""
        self._sent: dict[tuple[int, int], int] = {}
        self._filling = True
        # all of so many tracks was sent at this rate
        self._best: tuple[int, int] | None = None

    def has(self, track: int, index: int, rate: int) -> None:
        """The viewer has this block at this rate already."""
        self._sent[track, index] = max(rate, self._sent.get((track, index), rate))

    def next(
        self,
        state: TimelineState,
        clock: int,
        rate: int,
        audio: int | None = None,
        *,
        net: bool = False,
        spare: bool = True,
        better: bool = True,
        idle: int | None = None,
    ) -> Due | None:
        """The block to send now, None when enough is on its way.

        A block counts as sent once it was returned. `rate` is the wanted rate, kept within those each track has, and
        `audio` that of sound where it is another, -1 for none of it. `net` says that one is kept, as over a narrow
        line; sound is in none. Without `spare` room only what is missing soon is sent, and without `better` nothing
        that a viewer has at another rate. `idle` is the rate of what the line has time for: that of blocks that stay
        on show and, where a net is kept, of a loop all of which was sent; None for no more than that.
        """
        position = position_at(state, clock)
        rates = ((track, track.wanted(rate, audio)) for track in self.tracks)
        found = [
            due
            for track, wanted in rates
            if wanted >= 0 and (due := self._due(track, state, position, wanted, net, better)) is not None
        ]
        due = min(found, default=None)
        if due is None:
            self._filling = False
        soon = due is not None and not (due.far or due.better or due.distance > JUST)
        if idle is not None and spare and better and not soon:
            due = self._staying(state, position, idle) or due or (self._around(state, position, idle) if net else None)
        if due is None or (not spare and (due.far or due.better or (net and due.distance > SOON))):
            return None
        self._sent[due.track, due.index] = due.rate
        return due

    def fresh(self, state: TimelineState, clock: int) -> int:
        """Microseconds for which nothing comes within reach that was sent before, for those without a net: at most as
        long as a loop takes."""
        position = position_at(state, clock)
        fresh = state.duration
        for track in self.tracks:
            timing = track.timing
            blocks = timing.block_at(state.duration - 1) + 1
            first = min(timing.block_at(position), blocks - 1)
            for count in range(blocks + 1 if state.loop else blocks - first):
                turn, index = divmod(first + count, blocks)
                beyond = timing.start_us(index) + turn * state.duration - position - AHEAD
                if beyond >= fresh:
                    break
                if beyond >= 0 and (track.number, index) in self._sent:
                    fresh = beyond
        return fresh

    def wait(self, state: TimelineState, clock: int, net: bool = False) -> int | None:
        """Microseconds until the next block comes within reach, None while nothing moves."""
        if not state.playing or not self.tracks:
            return None
        reach = (position_at(state, clock) + (NET_AHEAD if net else AHEAD)) % state.duration
        return min(_following(track.timing, reach, state.duration) for track in self.tracks) - reach + MARGIN

    def _due(self, track: Paced, state: TimelineState, position: int, rate: int, net: bool, better: bool) -> Due | None:
        """What is to be sent first of one track."""
        timing, rate = track.timing, min(rate, track.rates - 1)
        # a track may be shorter or longer than the motion, and turns with it
        blocks = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(position), blocks - 1)
        place = track.place
        soonest = AGAIN if track.audio and state.duration > AHEAD + 1_000_000 else UPGRADE
        # sound is in no net
        net, after = (False, AFTER) if net and track.audio else (net, 0)
        ahead = NET_AHEAD if net else AHEAD
        found: list[Due] = []
        for count in range(blocks):
            turn, index = divmod(first + count, blocks)
            distance = max(timing.start_us(index) + turn * state.duration - position, 0)
            if distance > (NET if net else AHEAD) or (turn and not state.loop):
                break
            sent = self._sent.get((track.number, index))
            if after and sent is None and state.playing and distance == 0:
                # sound that would come after it has begun
                continue
            far = net and distance > (SAFE if sent is None else JUST)
            if sent is None:
                if far and distance <= REFILL:
                    self._filling = True
                if not far or self._filling:
                    low = net or (place < 2 and count == 0)
                    found.append(Due(far, False, distance + after, place, track.number, index, 0 if low else rate))
                if not far:
                    break
            elif better and sent < rate and soonest < distance <= ahead:
                found.append(Due(far, True, distance + after, place, track.number, index, rate))
        return min(found, default=None)

    def _staying(self, state: TimelineState, position: int, rate: int) -> Due | None:
        """What is to be bettered first of the blocks that stay on show: where the stage stands, and of tracks of one
        block."""
        stands = _stands(state, position)
        found: list[Due] = []
        for track in self.tracks:
            timing, best = track.timing, min(rate, track.rates - 1)
            blocks = timing.block_at(state.duration - 1) + 1
            if track.audio or not (stands or blocks == 1):
                continue
            first = min(timing.block_at(position), blocks - 1)
            # from a block's last frame on what is shown is the mix with the first of the next
            for turn, index in {divmod(first, blocks), divmod(first + 1, blocks)}:
                distance = max(timing.start_us(index) + turn * state.duration - position, 0)
                shown = distance < 1e6 / timing.fps and (state.loop or not turn)
                if shown and self._sent.get((track.number, index), best) < best:
                    found.append(Due(False, True, distance, track.place, track.number, index, best))
        return min(found, default=None)

    def _around(self, state: TimelineState, position: int, rate: int) -> Due | None:
        """What is to be bettered first of a loop all of which was sent, sound aside."""
        if not state.loop or self._best == (rate, len(self.tracks)):
            return None
        # one that came while it is on show would be seen to jump
        soonest = 0 if _stands(state, position) else min(JUST, state.duration // 2)
        found: list[Due] = []
        lower = False
        for track in self.tracks:
            timing, best = track.timing, min(rate, track.rates - 1)
            blocks = 0 if track.audio else timing.block_at(state.duration - 1) + 1
            first = min(timing.block_at(position), blocks - 1)
            for count in range(blocks):
                turn, index = divmod(first + count, blocks)
                sent = self._sent.get((track.number, index))
                if sent is None:
                    return None
                if sent < best:
                    lower = True
                    distance = timing.start_us(index) + turn * state.duration - position
                    if soonest < distance <= NET_AHEAD:
                        found.append(Due(False, True, distance, track.place, track.number, index, best))
        if not lower:
            self._best = rate, len(self.tracks)
        return min(found, default=None)


def arrivals(
    tracks: Sequence[Paced], state: TimelineState, clock: int, rate: int, audio: int | None = None
) -> list[Due]:
    """The blocks that have come within reach by `clock`, a time that `Pacer.wait` told, and had not just before it: as
    `Pacer.next` would tell one who has been sent all before them, without going through all that."""
    position = position_at(state, clock)
    reach = position + AHEAD
    before = position_at(state, clock - 2 * MARGIN)
    if state.loop and any(_again(track.timing, before, state.duration) <= AHEAD for track in tracks):
        # of so short a loop all is within reach, and what is on show may come better
        return _told(tracks, state, clock, rate, audio)
    found: list[Due] = []
    for track in tracks:
        wanted = track.wanted(rate, audio)
        if wanted < 0:
            continue
        timing = track.timing
        blocks = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(before), blocks - 1)
        place, rated = track.place, min(wanted, track.rates - 1)
        turn, into = divmod(reach, state.duration)
        index = min(timing.block_at(into) + 1, blocks - 1)
        while (start := timing.start_us(index) + turn * state.duration) > reach - 2 * MARGIN:
            # in a loop it was sent when it last came within reach, if it is still there
            sent = turn > 1 or (turn == 1 and index >= first)
            if start <= reach and not sent and (state.loop or not turn):
                found.append(Due(False, False, start - position, place, track.number, index, rated))
            turn, index = (turn, index - 1) if index else (turn - 1, blocks - 1)
            if turn < 0:
                break
    return sorted(found)


def _stands(state: TimelineState, position: int) -> bool:
    """Whether the stage stands still at `position`: paused, or at the end without a loop."""
    return not state.playing or (not state.loop and position >= state.duration)


def _again(timing: Timing, position: int, duration: int) -> int:
    """Microseconds until the block at `position` comes again in a loop."""
    return timing.start_us(timing.block_at(position)) + duration - position


def _told(tracks: Sequence[Paced], state: TimelineState, clock: int, rate: int, audio: int | None) -> list[Due]:
    """`arrivals` by sending all that was before."""
    pacer = Pacer(tracks)
    while pacer.next(state, clock - 2 * MARGIN, rate, audio) is not None:
        pass
    found: list[Due] = []
    while (due := pacer.next(state, clock, rate, audio)) is not None:
        found.append(due)
    return found


def _following(timing: Timing, reach: int, duration: int) -> int:
    """When the block after the one at `reach` starts, or the motion anew; microseconds."""
    following = timing.block_at(reach) + 1
    return min(timing.start_us(following), duration) if following < timing.blocks else duration
