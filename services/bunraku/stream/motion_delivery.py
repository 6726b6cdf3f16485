"""One motion as it is sent to one viewer: which block is next and at which rate, and what the viewer is told of it."""

from __future__ import annotations

from bunraku.codec.container import StoredMotion
from bunraku.delivery import allocation
from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.bitrate import BitrateSelector
from bunraku.delivery.block_scheduler import BlockScheduler
from bunraku.delivery.congestion import HEADER_BYTES
from bunraku.delivery.resume import ResumeState
from bunraku.stream.flow_control import FlowControl
from bunraku.stream.track_selection import (
    build_allocations,
    count_described_tracks,
    motion_bitrates,
    pack_description,
    select_tracks,
)
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import Choice, Report, TimelineState

OVERLAY_SHARING_US = 1_000_000
"""So long after an overlay the hands share a narrow line with blocks, microseconds."""
MAX_IDLE_BLOCK_S = 1.5
"""A block for which a narrow line has time takes it so many seconds at most: who plays on meanwhile waits for it."""


class MotionDelivery:
    """What one viewer has been sent of `motion`, and at which rate it is sent the rest; times are clock times in
    microseconds."""

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
        "tracks",
    )

    def __init__(self, motion: StoredMotion, track_types: tuple[str, ...], pinned_level: int | None) -> None:
        """`wanted` are the types of tracks whose blocks are sent, `pinned` the motion's rate to keep to, if any."""
        self.motion = motion
        self.tracks = select_tracks(motion, track_types)
        # tracks that the viewer is to be told of, and was
        self._track_count = count_described_tracks(motion, track_types)
        self._described_count = self._track_count
        self.scheduler = BlockScheduler(self.tracks)
        self.allocations = allocation.filter_by_motion_level(build_allocations(motion, track_types), pinned_level)
        first, safe = allocation.initial_index(self.allocations), allocation.fallback_index(self.allocations)
        self.selector = BitrateSelector(
            len(self.allocations), None, first, safe, [step.kbps for step in self.allocations]
        )
        # where no sound is sent all is the motion's
        costs = motion_bitrates(motion)
        self._motion_only_allocations = [BitrateAllocation(nth, -1, kbps) for nth, kbps in enumerate(costs)]
        self._motion_only_selector = BitrateSelector(len(self._motion_only_allocations), bitrates_kbps=costs)
        self._is_pinned = pinned_level is not None
        self._announces_level = "motion" in track_types
        self._is_constrained = False
        self._announced_choice: Choice | None = None
        self.has_unsent_choice = True
        """Whether `news` may have something to say."""

    @property
    def allocation(self) -> allocation.BitrateAllocation:
        """How motion and sound share the line now."""
        chosen = self._active_selector
        return (
            self._motion_only_allocations[chosen.level]
            if chosen is self._motion_only_selector
            else self.allocations[chosen.level]
        )

    @property
    def choice(self) -> tuple[int, str]:
        """The motion's rate now, and why."""
        return self.allocation.motion_level, "pinned" if self._is_pinned else self._active_selector.reason

    @property
    def _active_selector(self) -> BitrateSelector:
        silent = len(self.allocations) > 1 and self.allocations[0].audio_level < 0 <= self.allocations[-1].audio_level
        return (
            self._motion_only_selector if silent and not self._is_pinned and self.selector.level == 0 else self.selector
        )

    def resume_from(self, resume_state: ResumeState | None) -> bool:
        """What the viewer holds already is not sent again; whether it is of this motion."""
        if resume_state is None or resume_state.motion != self.motion.id:
            return False
        self._set_described_count(
            min(
                len(self.motion.tracks) if resume_state.track_count is None else resume_state.track_count,
                self._track_count,
            )
        )
        # dances are the first tracks; of one that is yet to be told of nothing can be held
        dances = self.motion.performers[: self._described_count]
        for number, (dance, (first, rates)) in enumerate(zip(dances, resume_state.performers, strict=False)):
            for index, rate in enumerate(rates, first):
                if rate >= 0:
                    self.scheduler.mark_sent(number, index % dance.track.block_count, rate)
        return True

    def initial_description(self, is_high_rtt: bool) -> bytes:
        """The Description that goes before all else: of the motion alone where the line is `far` and there is more."""
        self._set_described_count(1 if is_high_rtt and self._announces_level else self._track_count)
        return pack_description(self.motion, 0, self._described_count)

    def _set_described_count(self, count: int) -> None:
        self._described_count = count
        self.scheduler.tracks = [track for track in self.tracks if track.index < count]

    def process_report(self, report: Report, clock: int) -> bool:
        """How the viewer fares; whether rate or reason have changed."""
        before = self.allocation, self._active_selector.reason
        for choice in (self.selector, self._motion_only_selector):
            choice.process_report(report, clock)
        changed = (self.allocation, self._active_selector.reason) != before
        self.has_unsent_choice = self.has_unsent_choice or changed
        return changed

    def next_packet(self, state: TimelineState, clock: int, flow: FlowControl, overlay_waited_at: int) -> bytes | None:
        """The Data to send next, None when enough is on its way; an overlay waited for room at `beside_at`."""
        narrow = flow.is_constrained
        beside = narrow and clock - overlay_waited_at < OVERLAY_SHARING_US
        for choice in (self.selector, self._motion_only_selector):
            choice.update_throughput(flow.throughput, clock, beside)
        self._is_constrained = narrow
        step = self.allocations[0] if flow.is_unmeasured else self.allocation
        if self._described_count < self._track_count:
            due = self.scheduler.next_block(
                state, clock, step.motion_level, audio_level=step.audio_level, prefetch=True, has_spare_capacity=False
            )
            if due is None:
                # the motion goes on for a while
                known = self._described_count
                self._set_described_count(self._track_count)
                return pack_description(self.motion, known, self._described_count)
            return self.motion.packets[due.track][due.level][due.index]
        spare = not beside or flow.may_send_block()
        net = narrow or flow.is_high_rtt
        better = not net or flow.is_prefetch_delivered
        due = self.scheduler.next_block(
            state,
            clock,
            step.motion_level,
            audio_level=step.audio_level,
            prefetch=net,
            has_spare_capacity=spare,
            allow_upgrades=better,
            idle_level=step.motion_level if beside else self._idle_level(flow),
        )
        if not better and spare and (due is None or due.is_prefetch):
            flow.mark_prefetch_sent()
        return None if due is None else self.motion.packets[due.track][due.level][due.index]

    def _idle_level(self, flow: FlowControl) -> int:
        """The rate of what a line has time for: the highest of which a block takes it no longer than `STILL`, unless
        what it carries is not why there is a lower one."""
        step, carries = self.allocation, flow.throughput
        if flow.is_unmeasured or self._active_selector.reason in ("hidden", "machine"):
            return step.motion_level
        highest = self.allocations[-1].motion_level
        if carries is None:
            return highest
        # what a second of one performer costs on the line
        costs = (
            each.kbps * 125 / len(self.motion.performers) + HEADER_BYTES
            for each in self._motion_only_allocations[: highest + 1]
        )
        return max(
            [step.motion_level, *(rate for rate, cost in enumerate(costs) if cost <= MAX_IDLE_BLOCK_S * carries)]
        )

    def take_choice(self) -> bytes | None:
        """The framed choice of a rate, where the viewer has not been told yet."""
        self.has_unsent_choice = False
        if not self._announces_level:
            return None
        chosen = self._active_selector
        reason = "pinned" if self._is_pinned else chosen.reason
        choice = Choice(self.allocation.motion_level, reason, chosen.throughput_bps if self._is_constrained else None)
        told, self._announced_choice = self._announced_choice, choice
        if told is not None and (told.rate, told.reason) == (choice.rate, choice.reason):
            return None
        return encode_frame(choice.pack())
