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

SEND_AHEAD_US = 4_000_000
"""How far ahead of the play position blocks are pushed, microseconds."""
SCHEDULING_MARGIN_US = 1_000
"""So long after a block comes within reach it is looked for, microseconds."""
CONSTRAINED_AUDIO_DELAY_US = 3_000_000
"""Over a narrow line the motion goes before sound that is heard this much sooner, microseconds."""
UPGRADE_AHEAD_US = 10_000_000
"""As `AHEAD`, for better versions where a net is kept: such a line may stand for seconds."""
URGENT_PREFETCH_US = 8_000_000
"""What is shown within this goes though overlays share the line, microseconds."""
MIN_PREFETCH_US = 15_000_000
"""Nothing is bettered before the net reaches this far, microseconds."""
UPGRADE_FIRST_US = 2_000_000
"""What is shown within this is bettered before the rest of the net, microseconds."""
MAX_PREFETCH_US = 30_000_000
"""How far ahead of the play position the net reaches, microseconds."""
PREFETCH_REFILL_US = 20_000_000
"""It is filled again when it reaches less far: several small blocks together are one packet."""
MIN_UPGRADE_LEAD_US = 500_000
"""A better version of a block that a viewer has is worth sending only if it can still be decoded before it is shown."""
MIN_AUDIO_UPGRADE_LEAD_US = SEND_AHEAD_US - 1_000_000
"""The same of sound, but for short motions: it is bettered as it comes within reach once more in a loop. Bettering all
that waits already would fill a line for what is heard once for a few seconds."""


@dataclass(frozen=True, slots=True)
class ScheduledTrack:
    """A track that is sent: its index in the Description, when its blocks are, and how many rates it has. The blocks of
    a `base` track come first, and the first of them at the lowest rate: the motion's; next to them those of `audio`,
    alike."""

    index: int
    timing: Timing
    level_count: int
    is_motion: bool
    is_audio: bool = False

    @property
    def priority(self) -> int:
        """Among the blocks of one instant: the motion's first, then sound, then cameras and lights."""
        return 0 if self.is_motion else 1 if self.is_audio else 2

    def target_level(self, level: int, audio_level: int | None) -> int:
        """Which of `rate` and the rate of sound, where that is another, is this track's; below zero for none."""
        return max(level, 0) if audio_level is None or not self.is_audio else audio_level


@dataclass(frozen=True, slots=True, order=True)
class ScheduledBlock:
    """A block to be sent, those to be sent first being the least: whether it lies far ahead where a net is kept,
    whether it only betters one that was sent, how long until it is shown in microseconds (of sound over a narrow line
    `AFTER` longer), its place among others of the same instant, and which one it is."""

    is_prefetch: bool
    is_upgrade: bool
    lead_us: int
    priority: int
    track: int
    index: int
    level: int


class BlockScheduler:
    """What one viewer has been sent of one motion's tracks."""

    def __init__(self, tracks: Sequence[ScheduledTrack]) -> None:
        """Raises ValueError for a track without rates."""
        if any(track.level_count < 1 for track in tracks):
            raise ValueError("a track has one rate at least")
        self.tracks = tracks
        """Of others nothing is sent."""
        self._sent_levels: dict[tuple[int, int], int] = {}
        self._is_prefetching = True
        # all of so many tracks was sent at this rate
        self._completed: tuple[int, int] | None = None

    def mark_sent(self, track: int, index: int, level: int) -> None:
        """The viewer has this block at this rate already."""
        self._sent_levels[track, index] = max(level, self._sent_levels.get((track, index), level))

    def next_block(
        self,
        state: TimelineState,
        clock: int,
        level: int,
        audio_level: int | None = None,
        *,
        prefetch: bool = False,
        has_spare_capacity: bool = True,
        allow_upgrades: bool = True,
        idle_level: int | None = None,
    ) -> ScheduledBlock | None:
        """The block to send now, None when enough is on its way.

        A block counts as sent once it was returned. `rate` is the wanted rate, kept within those each track has, and
        `audio` that of sound where it is another, -1 for none of it. `net` says that one is kept, as over a narrow
        line; sound is in none. Without `spare` room only what is missing soon is sent, and without `better` nothing
        that a viewer has at another rate. `idle` is the rate of what the line has time for: that of blocks that stay
        on show and, where a net is kept, of a loop all of which was sent; None for no more than that.
        """
        position = position_at(state, clock)
        rates = ((track, track.target_level(level, audio_level)) for track in self.tracks)
        found = [
            due
            for track, wanted in rates
            if wanted >= 0
            and (due := self._next_of_track(track, state, position, wanted, prefetch, allow_upgrades)) is not None
        ]
        due = min(found, default=None)
        if due is None:
            self._is_prefetching = False
        soon = due is not None and not (due.is_prefetch or due.is_upgrade or due.lead_us > UPGRADE_FIRST_US)
        if idle_level is not None and has_spare_capacity and allow_upgrades and not soon:
            due = (
                self._next_visible_upgrade(state, position, idle_level)
                or due
                or (self._next_loop_upgrade(state, position, idle_level) if prefetch else None)
            )
        if due is None or (
            not has_spare_capacity
            and (due.is_prefetch or due.is_upgrade or (prefetch and due.lead_us > URGENT_PREFETCH_US))
        ):
            return None
        self._sent_levels[due.track, due.index] = due.level
        return due

    def time_until_resend(self, state: TimelineState, clock: int) -> int:
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
                beyond = timing.start_us(index) + turn * state.duration - position - SEND_AHEAD_US
                if beyond >= fresh:
                    break
                if beyond >= 0 and (track.index, index) in self._sent_levels:
                    fresh = beyond
        return fresh

    def time_until_next(self, state: TimelineState, clock: int, prefetch: bool = False) -> int | None:
        """Microseconds until the next block comes within reach, None while nothing moves."""
        if not state.playing or not self.tracks:
            return None
        reach = (position_at(state, clock) + (UPGRADE_AHEAD_US if prefetch else SEND_AHEAD_US)) % state.duration
        return (
            min(_next_block_start(track.timing, reach, state.duration) for track in self.tracks)
            - reach
            + SCHEDULING_MARGIN_US
        )

    def _next_of_track(
        self,
        track: ScheduledTrack,
        state: TimelineState,
        position: int,
        level: int,
        prefetch: bool,
        allow_upgrades: bool,
    ) -> ScheduledBlock | None:
        """What is to be sent first of one track."""
        timing, level = track.timing, min(level, track.level_count - 1)
        # a track may be shorter or longer than the motion, and turns with it
        blocks = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(position), blocks - 1)
        place = track.priority
        soonest = (
            MIN_AUDIO_UPGRADE_LEAD_US
            if track.is_audio and state.duration > SEND_AHEAD_US + 1_000_000
            else MIN_UPGRADE_LEAD_US
        )
        # sound is in no net
        prefetch, after = (False, CONSTRAINED_AUDIO_DELAY_US) if prefetch and track.is_audio else (prefetch, 0)
        ahead = UPGRADE_AHEAD_US if prefetch else SEND_AHEAD_US
        found: list[ScheduledBlock] = []
        for count in range(blocks):
            turn, index = divmod(first + count, blocks)
            distance = max(timing.start_us(index) + turn * state.duration - position, 0)
            if distance > (MAX_PREFETCH_US if prefetch else SEND_AHEAD_US) or (turn and not state.loop):
                break
            sent = self._sent_levels.get((track.index, index))
            if after and sent is None and state.playing and distance == 0:
                # sound that would come after it has begun
                continue
            far = prefetch and distance > (MIN_PREFETCH_US if sent is None else UPGRADE_FIRST_US)
            if sent is None:
                if far and distance <= PREFETCH_REFILL_US:
                    self._is_prefetching = True
                if not far or self._is_prefetching:
                    low = prefetch or (place < 2 and count == 0)
                    found.append(
                        ScheduledBlock(far, False, distance + after, place, track.index, index, 0 if low else level)
                    )
                if not far:
                    break
            elif allow_upgrades and sent < level and soonest < distance <= ahead:
                found.append(ScheduledBlock(far, True, distance + after, place, track.index, index, level))
        return min(found, default=None)

    def _next_visible_upgrade(self, state: TimelineState, position: int, level: int) -> ScheduledBlock | None:
        """What is to be bettered first of the blocks that stay on show: where the stage stands, and of tracks of one
        block."""
        stands = _is_still(state, position)
        found: list[ScheduledBlock] = []
        for track in self.tracks:
            timing, best = track.timing, min(level, track.level_count - 1)
            blocks = timing.block_at(state.duration - 1) + 1
            if track.is_audio or not (stands or blocks == 1):
                continue
            first = min(timing.block_at(position), blocks - 1)
            # from a block's last frame on what is shown is the mix with the first of the next
            for turn, index in {divmod(first, blocks), divmod(first + 1, blocks)}:
                distance = max(timing.start_us(index) + turn * state.duration - position, 0)
                shown = distance < 1e6 / timing.fps and (state.loop or not turn)
                if shown and self._sent_levels.get((track.index, index), best) < best:
                    found.append(ScheduledBlock(False, True, distance, track.priority, track.index, index, best))
        return min(found, default=None)

    def _next_loop_upgrade(self, state: TimelineState, position: int, level: int) -> ScheduledBlock | None:
        """What is to be bettered first of a loop all of which was sent, sound aside."""
        if not state.loop or self._completed == (level, len(self.tracks)):
            return None
        # one that came while it is on show would be seen to jump
        soonest = 0 if _is_still(state, position) else min(UPGRADE_FIRST_US, state.duration // 2)
        found: list[ScheduledBlock] = []
        lower = False
        for track in self.tracks:
            timing, best = track.timing, min(level, track.level_count - 1)
            blocks = 0 if track.is_audio else timing.block_at(state.duration - 1) + 1
            first = min(timing.block_at(position), blocks - 1)
            for count in range(blocks):
                turn, index = divmod(first + count, blocks)
                sent = self._sent_levels.get((track.index, index))
                if sent is None:
                    return None
                if sent < best:
                    lower = True
                    distance = timing.start_us(index) + turn * state.duration - position
                    if soonest < distance <= UPGRADE_AHEAD_US:
                        found.append(ScheduledBlock(False, True, distance, track.priority, track.index, index, best))
        if not lower:
            self._completed = level, len(self.tracks)
        return min(found, default=None)


def newly_due_blocks(
    tracks: Sequence[ScheduledTrack], state: TimelineState, clock: int, level: int, audio_level: int | None = None
) -> list[ScheduledBlock]:
    """The blocks that have come within reach by `clock`, a time that `Pacer.wait` told, and had not just before it: as
    `Pacer.next` would tell one who has been sent all before them, without going through all that."""
    position = position_at(state, clock)
    reach = position + SEND_AHEAD_US
    before = position_at(state, clock - 2 * SCHEDULING_MARGIN_US)
    if state.loop and any(
        _time_until_repeat(track.timing, before, state.duration) <= SEND_AHEAD_US for track in tracks
    ):
        # of so short a loop all is within reach, and what is on show may come better
        return _newly_due_by_replay(tracks, state, clock, level, audio_level)
    found: list[ScheduledBlock] = []
    for track in tracks:
        wanted = track.target_level(level, audio_level)
        if wanted < 0:
            continue
        timing = track.timing
        blocks = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(before), blocks - 1)
        place, rated = track.priority, min(wanted, track.level_count - 1)
        turn, into = divmod(reach, state.duration)
        index = min(timing.block_at(into) + 1, blocks - 1)
        while (start := timing.start_us(index) + turn * state.duration) > reach - 2 * SCHEDULING_MARGIN_US:
            # in a loop it was sent when it last came within reach, if it is still there
            sent = turn > 1 or (turn == 1 and index >= first)
            if start <= reach and not sent and (state.loop or not turn):
                found.append(ScheduledBlock(False, False, start - position, place, track.index, index, rated))
            turn, index = (turn, index - 1) if index else (turn - 1, blocks - 1)
            if turn < 0:
                break
    return sorted(found)


def _is_still(state: TimelineState, position: int) -> bool:
    """Whether the stage stands still at `position`: paused, or at the end without a loop."""
    return not state.playing or (not state.loop and position >= state.duration)


def _time_until_repeat(timing: Timing, position: int, duration: int) -> int:
    """Microseconds until the block at `position` comes again in a loop."""
    return timing.start_us(timing.block_at(position)) + duration - position


def _newly_due_by_replay(
    tracks: Sequence[ScheduledTrack], state: TimelineState, clock: int, level: int, audio_level: int | None
) -> list[ScheduledBlock]:
    """`arrivals` by sending all that was before."""
    pacer = BlockScheduler(tracks)
    while pacer.next_block(state, clock - 2 * SCHEDULING_MARGIN_US, level, audio_level) is not None:
        pass
    found: list[ScheduledBlock] = []
    while (due := pacer.next_block(state, clock, level, audio_level)) is not None:
        found.append(due)
    return found


def _next_block_start(timing: Timing, horizon: int, duration: int) -> int:
    """When the block after the one at `reach` starts, or the motion anew; microseconds."""
    following = timing.block_at(horizon) + 1
    return min(timing.start_us(following), duration) if following < timing.block_count else duration
