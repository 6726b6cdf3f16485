"""What the viewers of a session are sent next, worked out once for all who are in step.

Who has been sent all that is within reach waits for the next block to come within it; that instant, and what comes
then, are the same for all who have the same tracks at the same rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.codec.container import StoredMotion
from bunraku.delivery.allocation import BitrateAllocation
from bunraku.delivery.block_scheduler import BlockScheduler, ScheduledBlock, ScheduledTrack, newly_due_blocks
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import TimelineState

MAX_BATCHES = 64
"""Plans that are kept."""


@dataclass(frozen=True, slots=True)
class BlockBatch:
    """What comes within reach at an instant: the blocks, their messages framed, and the clock time when the next comes,
    None where nothing moves."""

    blocks: list[ScheduledBlock]
    framed: bytes
    next_due: int | None


class BlockBatchCache:
    """The plans for one timeline at a time."""

    def __init__(self) -> None:
        self._state: TimelineState | None = None
        self._batches: dict[tuple[BitrateAllocation, tuple[str, ...], int], BlockBatch] = {}

    def at(
        self,
        clock: int,
        state: TimelineState,
        motion: StoredMotion,
        allocation: BitrateAllocation,
        track_types: tuple[str, ...],
        tracks: Sequence[ScheduledTrack],
    ) -> BlockBatch:
        """The plan for clock time `clock`, which `Pacer.wait` told; `tracks` are those of the `wanted` types."""
        if state is not self._state or len(self._batches) >= MAX_BATCHES:
            self._state = state
            self._batches.clear()
        plan = self._batches.get((allocation, track_types, clock))
        if plan is None:
            dues = newly_due_blocks(tracks, state, clock, allocation.motion_level, allocation.audio_level)
            wait = BlockScheduler(tracks).time_until_next(state, clock)
            framed = b"".join(encode_frame(motion.packets[due.track][due.level][due.index]) for due in dues)
            plan = self._batches[allocation, track_types, clock] = BlockBatch(
                dues, framed, None if wait is None else clock + wait
            )
        return plan
