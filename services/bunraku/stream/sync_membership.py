"""One viewer's being in step with others: with whom, and until when."""

from __future__ import annotations

from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.block_scheduler import SCHEDULING_MARGIN_US
from bunraku.stream.motion_delivery import MotionDelivery
from bunraku.stream.sync_group import SyncGroup, SyncGroups, SyncMember, SyncParameters
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.wire.messages import TimelineState

SEND_SPREAD_US = 1_000_000
"""Blocks are due to all viewers of a session at once, and sent to each up to this much later, microseconds: little of
what is sent ahead, and the server's work is even."""
MIN_SYNC_US = 4_000_000
"""Who will be in step for less, microseconds, goes on alone."""


class SyncMembership:
    """Nobody at first. Times are clock times in microseconds."""

    __slots__ = ("_member", "expires_at", "group")

    def __init__(self, member: SyncMember) -> None:
        self._member = member
        self.group: SyncGroup | None = None
        """Those it is in step with: what comes for all of them is written to it too."""
        self.expires_at = 0
        """Until then at the latest."""

    def join(
        self,
        groups: SyncGroups,
        scheduler: TickScheduler,
        state: TimelineState,
        delivery: MotionDelivery,
        track_types: tuple[str, ...],
        next_due: int,
        phase: int,
    ) -> bool:
        """Go on with others, where it will be in step for a while: it was sent all that comes within reach before the
        instant `following`. `wanted` are the types of tracks, `phase` is how much later than they are due blocks go to
        it. Whether it does."""
        # what comes from that instant on, which may have passed
        begin = next_due - SCHEDULING_MARGIN_US
        fresh = delivery.scheduler.time_until_resend(state, begin)
        if fresh < MIN_SYNC_US:
            return False
        course = SyncParameters(state, delivery.motion, delivery.allocation, track_types)
        self.group = groups.join(self._member, scheduler, course, delivery.tracks, next_due, phase)
        self.expires_at = begin + fresh - SEND_SPREAD_US
        return self.group is not None

    def is_valid(self, now: int, allocation: BitrateAllocation) -> bool:
        """Whether it is in step still, at the rates that it is to have now."""
        return self.group is not None and now < self.expires_at and self.group.parameters.allocation == allocation

    def leave(self, delivery: MotionDelivery | None) -> None:
        """Go on alone; what it was sent meanwhile counts as sent in `playing`."""
        cohort, self.group = self.group, None
        if cohort is None:
            return
        sent = cohort.leave(self._member)
        if delivery is not None:
            for track, index, rate in sent:
                delivery.scheduler.mark_sent(track, index, rate)
