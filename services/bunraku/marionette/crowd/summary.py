"""Summary of a crowd's pulls of one limb, of constant size, whatever the number of members.

Each stream replica summarises the pulls of its viewers, and the owner of the session adds the summaries up. All sums
are of integers, so the result does not depend on the order. A pull is a point in -1..1 on three axes: a hand's place in
arm lengths, or a thigh's angle as a share of its largest, on the first.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import MAX_SHOWN_PULLS

UNITS = 8_192
"""Units of a coordinate of 1."""
BINS = 64
"""Bins of an axis. A median or trimmed mean differs from that of all pulls by less than the width of a bin."""
BIN_UNITS = 2 * UNITS // BINS
MAX_GESTURES = 8
SAMPLE_SIZE = MAX_SHOWN_PULLS
"""Pulls that are shown to viewers, those of the members with the smallest keys."""
MAX_MEMBERS = 65_536
"""Most pulls of one summary: their sums fit into 32 bits."""

Integers = npt.NDArray[np.int64]
Point = tuple[int, int, int]
"""Pull in units."""

_HEAD = struct.Struct("<IBBxxIB3xQ3h2x")
_SAMPLE = struct.Struct("<Q3h")
_TABLE_BYTES = 2 * 3 * BINS * 4
_VOTE_BYTES = 4 * MAX_GESTURES


class TurnCandidate(NamedTuple):
    """Member whose turn it is among those of a summary; of two candidates the smaller one counts."""

    negative_turn: int
    """Number of the turn, negative: a later turn comes first."""
    is_newcomer: bool
    """True if the member began to pull during the turn: any other comes first."""
    rank: int
    """Rank of the member in this turn, 64 bits."""
    point: Point


class SampledPull(NamedTuple):
    """Pull of one member; `key` is random, 64 bits."""

    key: int
    point: Point


@dataclass(frozen=True, slots=True)
class CrowdSummary:
    """Summary of the pulls of one limb: `counts` and `sums` (units) of each bin, both (3, BINS)."""

    count: int = 0
    counts: Integers = field(default_factory=lambda: np.zeros((3, BINS), np.int64))
    sums: Integers = field(default_factory=lambda: np.zeros((3, BINS), np.int64))
    votes: Integers = field(default_factory=lambda: np.zeros(MAX_GESTURES, np.int64))
    turn: TurnCandidate | None = None
    sample: tuple[SampledPull, ...] = ()

    def merge(self, other: CrowdSummary) -> CrowdSummary:
        """Return the summary of the pulls of both; commutative and associative."""
        turns = [one.turn for one in (self, other) if one.turn is not None]
        return CrowdSummary(
            self.count + other.count,
            self.counts + other.counts,
            self.sums + other.sums,
            self.votes + other.votes,
            min(turns, default=None),
            tuple(sorted(self.sample + other.sample)[:SAMPLE_SIZE]),
        )

    def pack(self) -> bytes:
        """Encode the summary; its size does not depend on the number of pulls."""
        turn = self.turn or TurnCandidate(0, False, 0, (0, 0, 0))
        head = _HEAD.pack(
            self.count, len(self.sample), self.turn is not None, -turn.negative_turn, turn.is_newcomer, turn.rank,
            *turn.point,
        )  # fmt: skip
        tables = self.counts.astype("<u4").tobytes() + self.sums.astype("<i4").tobytes()
        sample = b"".join(_SAMPLE.pack(one.key, *one.point) for one in self.sample)
        return head + tables + self.votes.astype("<u4").tobytes() + sample.ljust(SAMPLE_SIZE * _SAMPLE.size, b"\0")

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """Decode a summary; raises `MalformedMessage`."""
        if len(data) != SUMMARY_BYTES:
            raise MalformedMessage(f"crowd summary has {len(data)} bytes, expected {SUMMARY_BYTES}")
        count, sampled, has_turn, turn, is_newcomer, rank, x, y, z = _HEAD.unpack_from(data)
        at = _HEAD.size + _TABLE_BYTES
        counts = np.frombuffer(data, "<u4", 3 * BINS, _HEAD.size).reshape(3, BINS).astype(np.int64)
        sums = np.frombuffer(data, "<i4", 3 * BINS, _HEAD.size + _TABLE_BYTES // 2).reshape(3, BINS).astype(np.int64)
        if count > MAX_MEMBERS or sampled > min(count, SAMPLE_SIZE) or (counts.sum(axis=1) != count).any():
            raise MalformedMessage(f"crowd summary rejected: its bins do not have {count} pulls")
        sample = [_SAMPLE.unpack_from(data, at + _VOTE_BYTES + n * _SAMPLE.size) for n in range(sampled)]
        return cls(
            count,
            counts,
            sums,
            np.frombuffer(data, "<u4", MAX_GESTURES, at).astype(np.int64),
            TurnCandidate(-turn, bool(is_newcomer), rank, (x, y, z)) if has_turn else None,
            tuple(SampledPull(key, (px, py, pz)) for key, px, py, pz in sample),
        )

    def mean_between(self, low: float, high: float) -> tuple[float, float, float]:
        """Return the mean of the pulls of the ranks `low` to `high` on each axis, in 0..`count`, ordered by coordinate.

        A pull counts by the part of its rank, of length 1, that is between both. Within a bin that is only partly
        between both, each pull counts as the mean of the bin: the error is less than the width of a bin.
        """
        ends = np.cumsum(self.counts, axis=1)
        inside = np.clip(np.minimum(ends, high) - np.maximum(ends - self.counts, low), 0.0, None)
        means = self.sums / np.maximum(self.counts, 1)
        x, y, z = ((inside * means).sum(axis=1) / ((high - low) * UNITS)).tolist()
        return x, y, z


SUMMARY_BYTES = _HEAD.size + _TABLE_BYTES + _VOTE_BYTES + SAMPLE_SIZE * _SAMPLE.size
"""Size of an encoded summary."""
