"""Delivery of a motion to one viewer: announcement, blocks, and the choice of a bitrate level."""

from __future__ import annotations

from collections.abc import Callable

from bunraku import __version__
from bunraku.codec.container import StoredMotion
from bunraku.delivery import allocation
from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.bitrate import BitrateSelector
from bunraku.delivery.block_scheduler import BlockScheduler, SendPolicy
from bunraku.delivery.congestion import HEADER_BYTES
from bunraku.delivery.resume import ResumeState
from bunraku.playout.timeline import TimelineHistory
from bunraku.stream.flow_control import FlowControl, PrefetchState
from bunraku.stream.track_selection import (
    ViewerOptions,
    build_allocations,
    count_channels,
    count_described_tracks,
    motion_bitrates,
    pack_description,
    select_tracks,
)
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import ChannelHeader, Choice, Report, TimelineState

OVERLAY_SHARING_US = 1_000_000
"""Time after an overlay for which overlays share a constrained link with blocks, microseconds."""
MAX_IDLE_BLOCK_S = 1.5
"""Upper bound of the transmission time of a block sent while the link is idle, seconds: if playback resumes meanwhile,
the next block waits for it."""


class MotionDelivery:
    """Blocks of `motion` that one viewer has been sent, and the bitrate level of the following ones.

    All times are clock times in microseconds.
    """

    __slots__ = (
        "_announced_choice",
        "_announces_level",
        "_described_count",
        "_is_constrained",
        "_is_pinned",
        "_motion_only_allocations",
        "_motion_only_selector",
        "_track_count",
        "allocations",
        "has_unsent_choice",
        "motion",
        "scheduler",
        "selector",
        "track_types",
        "tracks",
    )

    def __init__(self, motion: StoredMotion, track_types: tuple[str, ...], pinned_level: int | None) -> None:
        """Send the tracks of `track_types`, the motion at `pinned_level` unless that is None."""
        self.motion = motion
        self.track_types = track_types
        self.tracks = select_tracks(motion, track_types)
        # tracks to describe to the viewer, and those described so far
        self._track_count = count_described_tracks(motion, track_types)
        self._described_count = self._track_count
        self.scheduler = BlockScheduler(self.tracks)
        self.allocations = allocation.filter_by_motion_level(build_allocations(motion, track_types), pinned_level)
        initial, fallback = allocation.initial_index(self.allocations), allocation.fallback_index(self.allocations)
        self.selector = BitrateSelector(
            len(self.allocations), None, initial, fallback, [each.kbps for each in self.allocations]
        )
        # while no audio is sent, the motion gets the whole bandwidth
        bitrates = motion_bitrates(motion)
        self._motion_only_allocations = [BitrateAllocation(level, -1, kbps) for level, kbps in enumerate(bitrates)]
        self._motion_only_selector = BitrateSelector(len(self._motion_only_allocations), bitrates_kbps=bitrates)
        self._is_pinned = pinned_level is not None
        self._announces_level = "motion" in track_types
        self._is_constrained = False
        self._announced_choice: Choice | None = None
        self.has_unsent_choice = True
        """True if `take_choice` may return a message."""

    @property
    def allocation(self) -> BitrateAllocation:
        """Present allocation of bandwidth to motion and audio."""
        active = self._active_selector
        return (
            self._motion_only_allocations[active.level]
            if active is self._motion_only_selector
            else self.allocations[active.level]
        )

    @property
    def choice(self) -> tuple[int, str]:
        """Present level of the motion, and the reason for it."""
        return self.allocation.motion_level, "pinned" if self._is_pinned else self._active_selector.reason

    @property
    def _active_selector(self) -> BitrateSelector:
        may_drop_audio = (
            len(self.allocations) > 1 and self.allocations[0].audio_level < 0 <= self.allocations[-1].audio_level
        )
        return (
            self._motion_only_selector
            if may_drop_audio and not self._is_pinned and self.selector.level == 0
            else self.selector
        )

    def resume_from(self, resume_state: ResumeState | None) -> bool:
        """Mark the blocks that the viewer already holds as sent; return False if they are of another motion."""
        if resume_state is None or resume_state.motion != self.motion.id:
            return False
        self._set_described_count(
            min(
                len(self.motion.tracks) if resume_state.track_count is None else resume_state.track_count,
                self._track_count,
            )
        )
        # performers are the first tracks; a viewer cannot hold blocks of one that was not described to it
        performers = self.motion.performers[: self._described_count]
        held = zip(performers, resume_state.performers, strict=False)
        for track, (performer, (first, levels)) in enumerate(held):
            for index, level in enumerate(levels, first):
                if level >= 0:
                    self.scheduler.mark_sent(track, index % performer.track.block_count, level)
        return True

    def initial_description(self, is_high_rtt: bool) -> bytes:
        """Return the first Description; on a high-RTT link it covers the first performer's motion alone."""
        self._set_described_count(1 if is_high_rtt and self._announces_level else self._track_count)
        return pack_description(self.motion, 0, self._described_count)

    def _set_described_count(self, count: int) -> None:
        self._described_count = count
        self.scheduler.tracks = [track for track in self.tracks if track.index < count]

    def process_report(self, report: Report, clock: int) -> bool:
        """Adapt the level to a viewer's report; return True if the level or its reason has changed."""
        before = self.allocation, self._active_selector.reason
        for selector in (self.selector, self._motion_only_selector):
            selector.process_report(report, clock)
        changed = (self.allocation, self._active_selector.reason) != before
        self.has_unsent_choice = self.has_unsent_choice or changed
        return changed

    def next_packet(self, state: TimelineState, clock: int, flow: FlowControl, overlay_waited_at: int) -> bytes | None:
        """Return the message to send next, None if enough was sent.

        It is a Data message, or the Description of the remaining tracks. `overlay_waited_at` is when an overlay last
        had to wait for capacity.
        """
        is_constrained = flow.is_constrained
        shares = is_constrained and clock - overlay_waited_at < OVERLAY_SHARING_US
        for selector in (self.selector, self._motion_only_selector):
            selector.update_throughput(flow.throughput, clock, shares)
        self._is_constrained = is_constrained
        target = self.allocations[0] if flow.is_unmeasured else self.allocation
        if self._described_count < self._track_count:
            due = self.scheduler.next_block(
                state,
                clock,
                SendPolicy(target.motion_level, target.audio_level, prefetch=True, has_spare_capacity=False),
            )
            if due is None:
                # enough of the motion was sent: describe the remaining tracks
                described = self._described_count
                self._set_described_count(self._track_count)
                return pack_description(self.motion, described, self._described_count)
            return self.motion.packets[due.track][due.level][due.index]
        has_spare_capacity = not shares or flow.may_send_block()
        prefetch = is_constrained or flow.state.is_high_rtt
        allow_upgrades = not prefetch or flow.prefetch_state is PrefetchState.DELIVERED
        due = self.scheduler.next_block(
            state,
            clock,
            SendPolicy(
                target.motion_level,
                target.audio_level,
                prefetch,
                has_spare_capacity,
                allow_upgrades,
                target.motion_level if shares else self._idle_level(flow),
            ),
        )
        if not allow_upgrades and has_spare_capacity and (due is None or due.is_prefetch):
            flow.mark_prefetch_sent()
        return None if due is None else self.motion.packets[due.track][due.level][due.index]

    def _idle_level(self, flow: FlowControl) -> int:
        """Return the level for blocks that are sent while the link is idle.

        It is the highest one whose blocks take at most `MAX_IDLE_BLOCK_S`. A level that is lower for another reason
        than the throughput stays.
        """
        current, throughput = self.allocation, flow.throughput
        if flow.is_unmeasured or self._active_selector.reason in ("hidden", "machine"):
            return current.motion_level
        highest = self.allocations[-1].motion_level
        if throughput is None:
            return highest
        # bytes on the wire of one second of one performer, for each level
        costs = (
            each.kbps * 125 / len(self.motion.performers) + HEADER_BYTES
            for each in self._motion_only_allocations[: highest + 1]
        )
        return max(
            [
                current.motion_level,
                *(level for level, cost in enumerate(costs) if cost <= MAX_IDLE_BLOCK_S * throughput),
            ]
        )

    def take_choice(self) -> bytes | None:
        """Return the framed Choice message if level or reason differ from the last one sent."""
        self.has_unsent_choice = False
        if not self._announces_level:
            return None
        active = self._active_selector
        reason = "pinned" if self._is_pinned else active.reason
        choice = Choice(self.allocation.motion_level, reason, active.throughput_bps if self._is_constrained else None)
        last, self._announced_choice = self._announced_choice, choice
        if last is not None and (last.rate, last.reason) == (choice.rate, choice.reason):
            return None
        return encode_frame(choice.pack())


class MotionFeed:
    """Timeline and motion of one viewer, in the order in which they are sent."""

    __slots__ = (
        "_announced",
        "_clock",
        "_pinned_level",
        "_resume_state",
        "_timeline_history",
        "_track_types",
        "delivery",
        "next_block_at",
    )

    def __init__(self, options: ViewerOptions, clock: Callable[[], int]) -> None:
        """`clock` returns the reference time in microseconds."""
        self._clock = clock
        self._pinned_level = options.pinned_level
        self._track_types = options.track_types
        self._resume_state = options.resume_state
        self._announced: tuple[StoredMotion, TimelineState] | None = None
        self._timeline_history = TimelineHistory()
        self.delivery: MotionDelivery | None = None
        self.next_block_at: int | None = None
        """Clock time at which the next block comes within reach; None while blocks are unsent, and if none follows."""

    @property
    def state(self) -> TimelineState | None:
        """Newest timeline; it may begin a little in the future, and its first blocks are sent before that."""
        return self._timeline_history.newest

    @property
    def has_unsent_choice(self) -> bool:
        """True if `take_choice` may return a message."""
        return self.delivery is not None and self.delivery.has_unsent_choice

    def set_timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """Switch to a new timeline and its motion; one of an epoch that is not newer changes nothing."""
        self._timeline_history.put(state)
        if self._timeline_history.newest is not state:
            return
        if self.delivery is None or self.delivery.motion is not motion:
            self.delivery = MotionDelivery(motion, self._track_types, self._pinned_level)

    def take_announcement(self, is_high_rtt: bool) -> list[bytes]:
        """Return the framed timeline if it is new, preceded by header and description of a new motion."""
        state, delivery, last = self._timeline_history.newest, self.delivery, self._announced
        if state is None or delivery is None or (last is not None and last[1] is state):
            return []
        motion = delivery.motion
        messages = [state.pack()]
        if last is None or last[0] is not motion:
            resume_state, self._resume_state = self._resume_state, None
            if not delivery.resume_from(resume_state):
                messages.insert(0, delivery.initial_description(is_high_rtt))
            messages.insert(0, ChannelHeader(motion.id, self._clock(), count_channels(motion), __version__).pack())
        self._announced = motion, state
        return [encode_frame(message) for message in messages]

    def next_packet(self, now: int, flow: FlowControl, overlay_waited_at: int) -> bytes | None:
        """Return the message to send next; see `MotionDelivery.next_packet`."""
        state = self._timeline_history.newest
        if state is None or self.delivery is None:
            return None
        return self.delivery.next_packet(state, now, flow, overlay_waited_at)

    def take_choice(self) -> bytes | None:
        """Return the framed Choice message, if there is a new one."""
        return None if self.delivery is None else self.delivery.take_choice()

    def update_next_block(self, now: int, prefetch: bool) -> None:
        """Set `next_block_at`, once all blocks within reach have been sent."""
        self.next_block_at = None
        state = self._timeline_history.newest
        if state is not None and self.delivery is not None:
            start = max(now, state.clock)
            wait = self.delivery.scheduler.time_until_next(state, start, prefetch)
            self.next_block_at = None if wait is None else start + wait
