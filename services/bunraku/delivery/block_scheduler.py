"""Scheduler of the blocks that one viewer is sent (design.md, Network).

The server sends ahead of the play position, in this order:

1. the motion's first block at the lowest level, so that something moves at once, then the first block of the audio at
its
   lowest level, and those of cameras and lights;
2. the blocks within `SEND_AHEAD_US` at the selected levels, the earliest first; of one instant the motion first, then
   audio, then cameras and lights;
3. higher levels of blocks already sent.

A block that the viewer has is not sent again at the same level.

On a link that is constrained or may stall, the lowest level is prefetched far ahead: a second of it costs about as much
as the headers of a packet. Upgrades are then sent shortly before they are shown. Playback continues through an outage
of half a minute.

While the link is idle, blocks that stay visible are upgraded first, if the stage is paused; then the rest of a loop
that was sent completely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bunraku.codec.timing import Timing
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import TimelineState

SEND_AHEAD_US = 4_000_000
"""Time before the play position by which blocks are sent, microseconds."""
SCHEDULING_MARGIN_US = 1_000
"""Delay with which the scheduler looks for a block that came within reach, microseconds."""
CONSTRAINED_AUDIO_DELAY_US = 3_000_000
"""On a constrained link motion is sent before audio that is heard up to this much earlier, microseconds."""
UPGRADE_AHEAD_US = 10_000_000
"""As `SEND_AHEAD_US`, for upgrades where a base layer is prefetched: such a link may stall for seconds."""
URGENT_PREFETCH_US = 8_000_000
"""Blocks shown within this time are sent even without spare capacity, microseconds."""
MIN_PREFETCH_US = 15_000_000
"""No block is upgraded before the prefetch reaches this far, microseconds."""
UPGRADE_FIRST_US = 2_000_000
"""Blocks shown within this time are upgraded before the rest is prefetched, microseconds."""
MAX_PREFETCH_US = 30_000_000
"""Time before the play position by which the base layer is prefetched, microseconds."""
PREFETCH_REFILL_US = 20_000_000
"""The prefetch is refilled when it reaches less far than this: several small blocks together are one packet."""
MIN_UPGRADE_LEAD_US = 500_000
"""Minimum lead time of an upgrade, microseconds: it must be decoded before it is shown."""
MIN_AUDIO_UPGRADE_LEAD_US = SEND_AHEAD_US - 1_000_000
"""Minimum lead time of an audio upgrade, microseconds, except in short motions. Audio is upgraded as it comes within
reach again in a loop: upgrading all buffered audio would fill a link for data that is heard once for a few seconds."""


class SendPolicy(NamedTuple):
    """Levels and limits by which the next block is chosen."""

    level: int
    """Target level, clamped to the levels of each track."""
    audio_level: int | None = None
    """Target level of audio: None for `level`, -1 for no audio."""
    prefetch: bool = False
    """Prefetch the lowest level, as on a constrained link; audio is not prefetched."""
    has_spare_capacity: bool = True
    """If False, only blocks that are missing and shown soon are sent."""
    allow_upgrades: bool = True
    """If False, no block is sent that the viewer has at another level."""
    idle_level: int | None = None
    """Level for the time in which the link is idle: of blocks that stay visible and, with `prefetch`, of a loop that
    was sent completely. None sends no such upgrades."""


@dataclass(frozen=True, slots=True)
class ScheduledTrack:
    """Track whose blocks are sent: index in the Description, timing, and number of levels.

    Blocks of a motion track come first, next those of an audio track; the first block of either is sent at the lowest
    level.
    """

    index: int
    timing: Timing
    level_count: int
    is_motion: bool
    is_audio: bool = False

    @property
    def priority(self) -> int:
        """Order among the blocks of one instant: motion, audio, then cameras and lights."""
        return 0 if self.is_motion else 1 if self.is_audio else 2

    def target_level(self, policy: SendPolicy) -> int:
        """Return the level of this track under `policy`, before it is clamped; negative for none."""
        if policy.audio_level is None or not self.is_audio:
            return max(policy.level, 0)
        return policy.audio_level


@dataclass(frozen=True, slots=True, order=True)
class ScheduledBlock:
    """Block to send. Blocks are ordered by urgency, the most urgent first."""

    is_prefetch: bool
    """True if it is far ahead, on a link with a prefetched base layer."""
    is_upgrade: bool
    """True if it replaces a block that was sent at a lower level."""
    lead_us: int
    """Time until it is shown; of audio on a constrained link `CONSTRAINED_AUDIO_DELAY_US` more."""
    priority: int
    """Order among the blocks of one instant."""
    track: int
    index: int
    level: int


class BlockScheduler:
    """Scheduler of the blocks of one motion's tracks for one viewer."""

    def __init__(self, tracks: Sequence[ScheduledTrack]) -> None:
        """Raise ValueError if a track has no level."""
        if any(track.level_count < 1 for track in tracks):
            raise ValueError("Track without a bitrate level: level_count must be at least 1")
        self.tracks = tracks
        """Tracks whose blocks are sent."""
        self._sent_levels: dict[tuple[int, int], int] = {}
        self._is_prefetching = True
        # idle level and number of tracks for which a loop was upgraded completely
        self._completed: tuple[int, int] | None = None

    def mark_sent(self, track: int, index: int, level: int) -> None:
        """Record that the viewer has a block at this level."""
        self._sent_levels[track, index] = max(level, self._sent_levels.get((track, index), level))

    def next_block(self, state: TimelineState, clock: int, policy: SendPolicy) -> ScheduledBlock | None:
        """Return the block to send at `clock`, None if enough was sent; a returned block counts as sent."""
        position = position_at(state, clock)
        prefetch = policy.prefetch
        found = [
            block for track in self.tracks if (block := self._next_of_track(track, state, position, policy)) is not None
        ]
        due = min(found, default=None)
        if due is None:
            self._is_prefetching = False
        is_urgent = due is not None and not (due.is_prefetch or due.is_upgrade or due.lead_us > UPGRADE_FIRST_US)
        if policy.idle_level is not None and policy.has_spare_capacity and policy.allow_upgrades and not is_urgent:
            due = (
                self._next_visible_upgrade(state, position, policy.idle_level)
                or due
                or (self._next_loop_upgrade(state, position, policy.idle_level) if prefetch else None)
            )
        if due is None or (
            not policy.has_spare_capacity
            and (due.is_prefetch or due.is_upgrade or (prefetch and due.lead_us > URGENT_PREFETCH_US))
        ):
            return None
        self._sent_levels[due.track, due.index] = due.level
        return due

    def time_until_resend(self, state: TimelineState, clock: int) -> int:
        """Return the time in which no block that was sent before comes within reach, microseconds.

        At most the duration of the motion. Valid without prefetch.
        """
        position = position_at(state, clock)
        unsent_us = state.duration
        for track in self.tracks:
            timing = track.timing
            block_count = timing.block_at(state.duration - 1) + 1
            first = min(timing.block_at(position), block_count - 1)
            for count in range(block_count + 1 if state.loop else block_count - first):
                turn, index = divmod(first + count, block_count)
                beyond = timing.start_us(index) + turn * state.duration - position - SEND_AHEAD_US
                if beyond >= unsent_us:
                    break
                if beyond >= 0 and (track.index, index) in self._sent_levels:
                    unsent_us = beyond
        return unsent_us

    def time_until_next(self, state: TimelineState, clock: int, prefetch: bool = False) -> int | None:
        """Return the time until the next block comes within reach, microseconds; None while nothing moves."""
        if not state.playing or not self.tracks:
            return None
        horizon = (position_at(state, clock) + (UPGRADE_AHEAD_US if prefetch else SEND_AHEAD_US)) % state.duration
        return (
            min(_next_block_start(track.timing, horizon, state.duration) for track in self.tracks)
            - horizon
            + SCHEDULING_MARGIN_US
        )

    def _next_of_track(
        self, track: ScheduledTrack, state: TimelineState, position: int, policy: SendPolicy
    ) -> ScheduledBlock | None:
        """Return the most urgent block of one track."""
        target = track.target_level(policy)
        if target < 0:
            return None
        timing, level = track.timing, min(target, track.level_count - 1)
        # a track may be shorter or longer than the motion, and loops with it
        block_count = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(position), block_count - 1)
        priority = track.priority
        min_upgrade_lead = (
            MIN_AUDIO_UPGRADE_LEAD_US
            if track.is_audio and state.duration > SEND_AHEAD_US + 1_000_000
            else MIN_UPGRADE_LEAD_US
        )
        # audio is not prefetched
        prefetch, delay = policy.prefetch, 0
        if prefetch and track.is_audio:
            prefetch, delay = False, CONSTRAINED_AUDIO_DELAY_US
        ahead = UPGRADE_AHEAD_US if prefetch else SEND_AHEAD_US
        found: list[ScheduledBlock] = []
        for count in range(block_count):
            turn, index = divmod(first + count, block_count)
            lead = max(timing.start_us(index) + turn * state.duration - position, 0)
            if lead > (MAX_PREFETCH_US if prefetch else SEND_AHEAD_US) or (turn and not state.loop):
                break
            sent = self._sent_levels.get((track.index, index))
            if delay and sent is None and state.playing and lead == 0:
                # audio that would arrive after its start
                continue
            is_far = prefetch and lead > (MIN_PREFETCH_US if sent is None else UPGRADE_FIRST_US)
            if sent is None:
                if is_far and lead <= PREFETCH_REFILL_US:
                    self._is_prefetching = True
                if not is_far or self._is_prefetching:
                    use_lowest = prefetch or (priority < 2 and count == 0)
                    found.append(
                        ScheduledBlock(
                            is_far, False, lead + delay, priority, track.index, index, 0 if use_lowest else level
                        )
                    )
                if not is_far:
                    break
            elif policy.allow_upgrades and sent < level and min_upgrade_lead < lead <= ahead:
                found.append(ScheduledBlock(is_far, True, lead + delay, priority, track.index, index, level))
        return min(found, default=None)

    def _next_visible_upgrade(self, state: TimelineState, position: int, level: int) -> ScheduledBlock | None:
        """Return the most urgent upgrade of a block that stays visible: on a paused stage, or of a one-block track."""
        is_still = _is_still(state, position)
        found: list[ScheduledBlock] = []
        for track in self.tracks:
            timing, best = track.timing, min(level, track.level_count - 1)
            block_count = timing.block_at(state.duration - 1) + 1
            if track.is_audio or not (is_still or block_count == 1):
                continue
            first = min(timing.block_at(position), block_count - 1)
            # after a block's last frame the viewer shows a mix with the first frame of the next block
            for turn, index in {divmod(first, block_count), divmod(first + 1, block_count)}:
                lead = max(timing.start_us(index) + turn * state.duration - position, 0)
                is_visible = lead < 1e6 / timing.fps and (state.loop or not turn)
                if is_visible and self._sent_levels.get((track.index, index), best) < best:
                    found.append(ScheduledBlock(False, True, lead, track.priority, track.index, index, best))
        return min(found, default=None)

    def _next_loop_upgrade(self, state: TimelineState, position: int, level: int) -> ScheduledBlock | None:
        """Return the most urgent upgrade in a loop that was sent completely, audio excepted."""
        if not state.loop or self._completed == (level, len(self.tracks)):
            return None
        # an upgrade that arrives while its block is visible would be seen as a jump
        min_lead = 0 if _is_still(state, position) else min(UPGRADE_FIRST_US, state.duration // 2)
        found: list[ScheduledBlock] = []
        has_lower_level = False
        for track in self.tracks:
            timing, best = track.timing, min(level, track.level_count - 1)
            block_count = 0 if track.is_audio else timing.block_at(state.duration - 1) + 1
            first = min(timing.block_at(position), block_count - 1)
            for count in range(block_count):
                turn, index = divmod(first + count, block_count)
                sent = self._sent_levels.get((track.index, index))
                if sent is None:
                    return None
                if sent < best:
                    has_lower_level = True
                    lead = timing.start_us(index) + turn * state.duration - position
                    if min_lead < lead <= UPGRADE_AHEAD_US:
                        found.append(ScheduledBlock(False, True, lead, track.priority, track.index, index, best))
        if not has_lower_level:
            self._completed = level, len(self.tracks)
        return min(found, default=None)


def newly_due_blocks(
    tracks: Sequence[ScheduledTrack], state: TimelineState, clock: int, policy: SendPolicy
) -> list[ScheduledBlock]:
    """Return the blocks that come within reach at `clock`, a time that `BlockScheduler.time_until_next` gave.

    The result equals that of `BlockScheduler.next_block` for a viewer that was sent all earlier blocks, without the
    search. `policy` has levels only.
    """
    position = position_at(state, clock)
    horizon = position + SEND_AHEAD_US
    before = position_at(state, clock - 2 * SCHEDULING_MARGIN_US)
    if state.loop and any(
        _time_until_repeat(track.timing, before, state.duration) <= SEND_AHEAD_US for track in tracks
    ):
        # the whole of such a short loop is within reach, and visible blocks may be upgraded
        return _newly_due_by_replay(tracks, state, clock, policy)
    found: list[ScheduledBlock] = []
    for track in tracks:
        target = track.target_level(policy)
        if target < 0:
            continue
        timing = track.timing
        block_count = timing.block_at(state.duration - 1) + 1
        first = min(timing.block_at(before), block_count - 1)
        priority, level = track.priority, min(target, track.level_count - 1)
        turn, into = divmod(horizon, state.duration)
        index = min(timing.block_at(into) + 1, block_count - 1)
        while (start := timing.start_us(index) + turn * state.duration) > horizon - 2 * SCHEDULING_MARGIN_US:
            # in a loop, a block that is still within reach was sent in the previous turn
            was_sent = turn > 1 or (turn == 1 and index >= first)
            if start <= horizon and not was_sent and (state.loop or not turn):
                found.append(ScheduledBlock(False, False, start - position, priority, track.index, index, level))
            turn, index = (turn, index - 1) if index else (turn - 1, block_count - 1)
            if turn < 0:
                break
    return sorted(found)


def _is_still(state: TimelineState, position: int) -> bool:
    """Return True if the stage is paused, or at the end of a motion that does not loop."""
    return not state.playing or (not state.loop and position >= state.duration)


def _time_until_repeat(timing: Timing, position: int, duration: int) -> int:
    """Return the time until the block at `position` starts again in a loop, microseconds."""
    return timing.start_us(timing.block_at(position)) + duration - position


def _newly_due_by_replay(
    tracks: Sequence[ScheduledTrack], state: TimelineState, clock: int, policy: SendPolicy
) -> list[ScheduledBlock]:
    """Return the same as `newly_due_blocks`, by sending all earlier blocks first."""
    scheduler = BlockScheduler(tracks)
    while scheduler.next_block(state, clock - 2 * SCHEDULING_MARGIN_US, policy) is not None:
        pass
    found: list[ScheduledBlock] = []
    while (due := scheduler.next_block(state, clock, policy)) is not None:
        found.append(due)
    return found


def _next_block_start(timing: Timing, horizon: int, duration: int) -> int:
    """Return the start of the block after the one at `horizon`, or of the next turn, microseconds."""
    following = timing.block_at(horizon) + 1
    return min(timing.start_us(following), duration) if following < timing.block_count else duration
