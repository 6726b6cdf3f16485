"""Viewers of a session who are in step: what comes for one of them comes for all, and is written to all at once.

What costs is not the writing but going from viewer to viewer, whose things lie all over the memory. So who has been
sent all that is within reach, over a quick line, needs no turns of its own for the blocks that follow: it joins a
cohort, which has one turn for all. Blocks are due to all viewers of a session at once; each cohort is sent them up to a
second later, so that the server's work is even.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from bunraku.codec.container import StoredMotion
from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.block_scheduler import ScheduledTrack
from bunraku.delivery.timing_wheel import SLOT_US
from bunraku.stream.block_batch import BlockBatchCache
from bunraku.stream.counters import StreamCounters
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.multicast import PLAIN_SENDER, MulticastGroup, MulticastSender
from bunraku.wire.messages import TimelineState


class SyncMember(Protocol):
    """A viewer, as its cohort sees it; its outlet is `clear`."""

    connection: WebSocketConnection


@dataclass(frozen=True, slots=True)
class SyncParameters:
    """What those who are in step have in common: the timeline, the motion, how motion and sound share the line, and the
    types of tracks that are wanted."""

    state: TimelineState
    motion: StoredMotion
    allocation: BitrateAllocation
    track_types: tuple[str, ...]

    @property
    def key(self) -> tuple[int, BitrateAllocation, tuple[str, ...]]:
        """Of one session, what tells one course from another."""
        return self.state.epoch, self.allocation, self.track_types


class SyncGroup:
    """Those who are in step and are sent what comes `phase` microseconds after it is due."""

    __slots__ = (
        "_groups",
        "_members",
        "_multicast",
        "_plans",
        "_scheduler",
        "_sent",
        "_tracks",
        "next_due",
        "parameters",
        "phase",
    )

    def __init__(
        self,
        groups: SyncGroups,
        scheduler: TickScheduler,
        parameters: SyncParameters,
        tracks: Sequence[ScheduledTrack],
        next_due: int,
        phase: int,
    ) -> None:
        self._groups = groups
        self._scheduler = scheduler
        self._tracks = tracks
        self.parameters = parameters
        self.next_due: int | None = next_due
        """Clock time of the next instant at which something comes within reach, None where nothing will."""
        self.phase = phase
        # each with the first instant that is sent to it here
        self._members: dict[SyncMember, int] = {}
        self._multicast: MulticastGroup | None = None
        # of each block the rate, and the instant at which it was sent last
        self._sent: dict[tuple[int, int], tuple[int, int]] = {}
        scheduler.schedule(self, next_due + phase)

    def join(self, member: SyncMember, next_due: int) -> bool:
        """One comes who has been sent all before the instant `following`; whether it can."""
        if self.next_due is None or next_due < self.next_due:
            return False
        self._members[member] = next_due
        self._multicast = None
        return True

    def leave(self, member: SyncMember) -> Iterator[tuple[int, int, int]]:
        """One goes: track, index and rate of each block that it was sent here."""
        begun = self._members.pop(member)
        self._multicast = None
        if not self._members:
            self._scheduler.cancel(self)
            self._groups.remove(self)
        return ((*block, rate) for block, (rate, at) in self._sent.items() if at >= begun)

    def tick(self) -> None:
        """Have a turn: send what came within reach."""
        course, at = self.parameters, self.next_due
        if at is None:
            return
        plan = self._groups.batches.at(
            at, course.state, course.motion, course.allocation, course.track_types, self._tracks
        )
        self._sent.update({(due.track, due.index): (due.level, at) for due in plan.blocks})
        self.next_due = plan.next_due
        if self.next_due is not None:
            self._scheduler.schedule(self, self.next_due + self.phase)
        if self._multicast is None:
            now = [member.connection for member, begun in self._members.items() if begun <= at]
            together = MulticastGroup(now, self._groups.sender)
            if len(now) == len(self._members):
                self._multicast = together
        else:
            together = self._multicast
        if plan.framed:
            attendance = self._groups.counters
            attendance.bytes += together.write(plan.framed)
            attendance.blocks += len(plan.blocks) * len(together)


class SyncGroups:
    """The cohorts of one session."""

    def __init__(
        self,
        batches: BlockBatchCache,
        counters: StreamCounters | None = None,
        sender: MulticastSender = PLAIN_SENDER,
    ) -> None:
        """`attendance` counts what is sent."""
        self.batches = batches
        self.sender = sender
        self.counters = counters or StreamCounters()
        self._groups: dict[tuple[object, ...], SyncGroup] = {}

    def join(
        self,
        member: SyncMember,
        scheduler: TickScheduler,
        parameters: SyncParameters,
        tracks: Sequence[ScheduledTrack],
        next_due: int,
        phase: int,
    ) -> SyncGroup | None:
        """The cohort that a viewer who was sent all before the instant `following` is in from now on, None where it
        cannot be in one yet; `tracks` are those of the wanted types, `phase` is in microseconds."""
        slot = phase // SLOT_US
        key = (*parameters.key, slot)
        cohort = self._groups.get(key)
        if cohort is None:
            cohort = self._groups[key] = SyncGroup(self, scheduler, parameters, tracks, next_due, slot * SLOT_US)
        elif cohort.parameters.state is not parameters.state:
            return None
        return cohort if cohort.join(member, next_due) else None

    def remove(self, group: SyncGroup) -> None:
        """The last one left it."""
        self._groups = {key: one for key, one in self._groups.items() if one is not group}

    def __iter__(self) -> Iterator[SyncGroup]:
        return iter(tuple(self._groups.values()))
