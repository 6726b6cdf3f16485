"""Synchronised groups: viewers of one session that are due the same blocks and are served by one write.

The cost of a fan-out is the walk from viewer to viewer, whose objects lie all over the memory, not the write. A viewer
on an unlimited link that has been sent all blocks within reach therefore needs no separate tick for the following
ones: it joins a group, which has one tick for all members. Blocks are due to all viewers of a session at once; each
group sends them with its own delay of up to a second, which spreads the load of the server.

All times are clock times in microseconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from bunraku.codec.container import StoredMotion
from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.block_scheduler import (
    SCHEDULING_MARGIN_US,
    BlockScheduler,
    ScheduledBlock,
    ScheduledTrack,
    SendPolicy,
    newly_due_blocks,
)
from bunraku.delivery.timing_wheel import SLOT_US
from bunraku.stream.context import StreamContext
from bunraku.stream.motion_delivery import MotionDelivery
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.multicast import MulticastGroup
from bunraku.wire.messages import TimelineState

MAX_BATCHES = 64
"""Block batches that are kept."""
SEND_SPREAD_US = 1_000_000
"""Upper bound of the delay with which due blocks are sent, microseconds: a small part of the send-ahead time."""
MIN_SYNC_US = 4_000_000
"""A viewer joins a group only if it can stay for this long, microseconds."""


class SyncMember(Protocol):
    """Viewer whose connection is writable."""

    connection: WebSocketConnection


@dataclass(frozen=True, slots=True)
class SyncParameters:
    """Parameters that the members of a group have in common and that decide which blocks are due."""

    state: TimelineState
    motion: StoredMotion
    allocation: BitrateAllocation
    track_types: tuple[str, ...]
    tracks: Sequence[ScheduledTrack] = field(compare=False)
    """Tracks of `track_types`."""

    @property
    def key(self) -> tuple[int, BitrateAllocation, tuple[str, ...]]:
        """Key of the parameters within one session."""
        return self.state.epoch, self.allocation, self.track_types


@dataclass(frozen=True, slots=True)
class BlockBatch:
    """Blocks that come within reach at one instant."""

    blocks: list[ScheduledBlock]
    framed: bytes
    """Their messages, framed."""
    next_due: int | None
    """Time of the next batch; None while nothing moves."""


class BlockBatchCache:
    """Block batches of one session, computed once for all groups; for one timeline at a time."""

    def __init__(self) -> None:
        self._state: TimelineState | None = None
        self._batches: dict[tuple[BitrateAllocation, tuple[str, ...], int], BlockBatch] = {}

    def at(self, due: int, parameters: SyncParameters) -> BlockBatch:
        """Return the batch for `due`, an instant that `BlockScheduler.time_until_next` returned."""
        state, motion, allocation = parameters.state, parameters.motion, parameters.allocation
        if state is not self._state or len(self._batches) >= MAX_BATCHES:
            self._state = state
            self._batches.clear()
        key = allocation, parameters.track_types, due
        batch = self._batches.get(key)
        if batch is None:
            tracks = parameters.tracks
            blocks = newly_due_blocks(tracks, state, due, SendPolicy(allocation.motion_level, allocation.audio_level))
            wait = BlockScheduler(tracks).time_until_next(state, due)
            framed = b"".join(encode_frame(motion.packets[block.track][block.level][block.index]) for block in blocks)
            batch = self._batches[key] = BlockBatch(blocks, framed, None if wait is None else due + wait)
        return batch


class SyncGroup:
    """Viewers that are sent due blocks together, `phase` microseconds after they are due."""

    __slots__ = ("_groups", "_members", "_multicast", "_sent", "next_due", "parameters", "phase")

    def __init__(self, groups: SyncGroups, parameters: SyncParameters, next_due: int, phase: int) -> None:
        self._groups = groups
        self.parameters = parameters
        self.next_due: int | None = next_due
        """Time at which the next blocks come within reach; None if none will."""
        self.phase = phase
        # first due time that each member is sent here
        self._members: dict[SyncMember, int] = {}
        self._multicast: MulticastGroup | None = None
        # level of each block (track, index), and the due time at which it was last sent
        self._sent: dict[tuple[int, int], tuple[int, int]] = {}
        groups.context.scheduler.schedule(self, next_due + phase)

    def join(self, member: SyncMember, next_due: int) -> bool:
        """Add a viewer that has been sent all blocks due before `next_due`; return False if the group is behind."""
        if self.next_due is None or next_due < self.next_due:
            return False
        self._members[member] = next_due
        self._multicast = None
        return True

    def leave(self, member: SyncMember) -> Iterator[tuple[int, int, int]]:
        """Remove a member; return track, index and level of each block that it was sent here."""
        first_due = self._members.pop(member)
        self._multicast = None
        if not self._members:
            self._groups.context.scheduler.cancel(self)
            self._groups.remove(self)
        return ((*block, level) for block, (level, due) in self._sent.items() if due >= first_due)

    def tick(self) -> None:
        """Send the blocks that came within reach."""
        due = self.next_due
        if due is None:
            return
        batch = self._groups.batches.at(due, self.parameters)
        self._sent.update({(block.track, block.index): (block.level, due) for block in batch.blocks})
        self.next_due = batch.next_due
        context = self._groups.context
        if self.next_due is not None:
            context.scheduler.schedule(self, self.next_due + self.phase)
        multicast = self._multicast
        if multicast is None:
            ready = [member.connection for member, first_due in self._members.items() if first_due <= due]
            multicast = MulticastGroup(ready, context.sender)
            if len(ready) == len(self._members):
                self._multicast = multicast
        if batch.framed:
            counters = context.counters
            # before the addition reads the counter, as writes to single connections increment it too
            sent_bytes = multicast.write(batch.framed)
            counters.bytes += sent_bytes
            counters.blocks += len(batch.blocks) * len(multicast)


class SyncGroups:
    """Synchronised groups of one session."""

    def __init__(self, context: StreamContext) -> None:
        self.context = context
        self.batches = BlockBatchCache()
        self._groups: dict[tuple[object, ...], SyncGroup] = {}

    def join(self, member: SyncMember, parameters: SyncParameters, next_due: int, phase: int) -> SyncGroup | None:
        """Add a viewer that has been sent all blocks due before `next_due` to the group of its parameters and phase.

        Return None if that group is behind the viewer or has an older timeline.
        """
        slot = phase // SLOT_US
        key = (*parameters.key, slot)
        group = self._groups.get(key)
        if group is None:
            group = self._groups[key] = SyncGroup(self, parameters, next_due, slot * SLOT_US)
        elif group.parameters.state is not parameters.state:
            return None
        return group if group.join(member, next_due) else None

    def remove(self, group: SyncGroup) -> None:
        """Remove a group without members."""
        self._groups = {key: each for key, each in self._groups.items() if each is not group}

    def __iter__(self) -> Iterator[SyncGroup]:
        return iter(tuple(self._groups.values()))


class SyncMembership:
    """Membership of one viewer in a group, and its end."""

    __slots__ = ("expires_at", "group", "phase")

    def __init__(self, phase: int) -> None:
        """`phase` is the delay with which due blocks are sent to the viewer, microseconds."""
        self.phase = phase
        self.group: SyncGroup | None = None
        """Present group, whose blocks are written to the viewer too."""
        self.expires_at = 0
        """Time at which the viewer has to leave the group."""

    def join(
        self, member: SyncMember, groups: SyncGroups, state: TimelineState, delivery: MotionDelivery, next_due: int
    ) -> bool:
        """Join a group if the viewer can stay in it for `MIN_SYNC_US`; return True if it joined.

        All blocks that are due before `next_due` must have been sent.
        """
        # `next_due` may have passed already
        begin = next_due - SCHEDULING_MARGIN_US
        unsent_us = delivery.scheduler.time_until_resend(state, begin)
        if unsent_us < MIN_SYNC_US:
            return False
        parameters = SyncParameters(state, delivery.motion, delivery.allocation, delivery.track_types, delivery.tracks)
        self.group = groups.join(member, parameters, next_due, self.phase)
        self.expires_at = begin + unsent_us - SEND_SPREAD_US
        return self.group is not None

    def is_valid(self, now: int, allocation: BitrateAllocation) -> bool:
        """Return True if the viewer may stay in its group, given its present allocation."""
        return self.group is not None and now < self.expires_at and self.group.parameters.allocation == allocation

    def leave(self, member: SyncMember, delivery: MotionDelivery | None) -> None:
        """Leave the group, if any, and mark the blocks received there as sent in `delivery`."""
        group, self.group = self.group, None
        if group is None:
            return
        sent = group.leave(member)
        if delivery is not None:
            for track, index, level in sent:
                delivery.scheduler.mark_sent(track, index, level)
