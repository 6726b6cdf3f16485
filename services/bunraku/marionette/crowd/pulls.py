"""Live pulls of one limb at a stream replica, and their summary. Times are clock time in µs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.marionette.crowd.policy import TURN_US, gesture_points, to_point
from bunraku.marionette.crowd.summary import (
    BIN_UNITS,
    BINS,
    MAX_GESTURES,
    MAX_MEMBERS,
    SAMPLE_SIZE,
    UNITS,
    CrowdSummary,
    Integers,
    Point,
    SampledPull,
    TurnCandidate,
)
from bunraku.marionette.solver.vector import Vector

PULL_LIFETIME_US = 400_000
"""Silence of a member after which its pull ends."""
_AXIS_OFFSETS = np.array([0, BINS, 2 * BINS])


class CrowdPulls:
    """Newest pull of each member for one limb. Members have random keys of 64 bits that they do not know."""

    def __init__(self, limb: int) -> None:
        self._gestures = gesture_points(limb)
        self._limb = limb
        # key -> begin of the pull, time of the newest message, point
        self._pulls: dict[int, tuple[int, int, Point]] = {}

    def __len__(self) -> int:
        return len(self._pulls)

    def pull(self, key: int, values: Vector, now: int) -> None:
        """Record a member's target; it has no effect beyond `MAX_MEMBERS` members."""
        before = self._pulls.get(key)
        if before is None and len(self._pulls) >= MAX_MEMBERS:
            return
        begin = now if before is None or now - before[1] > PULL_LIFETIME_US else before[0]
        self._pulls[key] = begin, now, to_point(self._limb, values)

    def leave(self, key: int) -> None:
        """Forget the pull of a member."""
        self._pulls.pop(key, None)

    def find_rank(self, turn: int, rank: int) -> int | None:
        """Return the key of the member who has this rank in a turn; None if it is at another replica."""
        keys = np.fromiter(self._pulls, np.uint64, len(self._pulls))
        found = keys[_rank(keys, turn) == np.uint64(rank)]
        return int(found[0]) if found.size else None

    def summarise(self, now: int) -> CrowdSummary:
        """Drop the pulls that have ended, and return the summary of the others."""
        for key in [key for key, (_, newest, _) in self._pulls.items() if now - newest > PULL_LIFETIME_US]:
            del self._pulls[key]
        if not self._pulls:
            return CrowdSummary()
        count = len(self._pulls)
        keys = np.fromiter(self._pulls, np.uint64, count)
        begins = np.fromiter((begin for begin, _, _ in self._pulls.values()), np.int64, count)
        points = np.array([point for _, _, point in self._pulls.values()], np.int64)
        places = (np.clip((points + UNITS) // BIN_UNITS, 0, BINS - 1) + _AXIS_OFFSETS).ravel()
        counts = np.bincount(places, minlength=3 * BINS).reshape(3, BINS)
        # sums below 2^53 are exact
        sums = np.bincount(places, points.ravel(), 3 * BINS).astype(np.int64).reshape(3, BINS)
        distances = ((points[:, None] - self._gestures[None]) ** 2).sum(axis=2)
        votes = np.bincount(distances.argmin(axis=1), minlength=MAX_GESTURES)
        first = np.argsort(keys, kind="stable")[:SAMPLE_SIZE]
        sample = tuple(SampledPull(int(keys[n]), _point(points[n])) for n in first)
        return CrowdSummary(count, counts, sums, votes, _find_turn(keys, begins, points, now), sample)


def _find_turn(keys: npt.NDArray[np.uint64], begins: Integers, points: Integers, now: int) -> TurnCandidate:
    """Return the member of the smallest rank, of those who pulled when the turn began if there are any."""
    turn = now // TURN_US
    is_newcomer = begins > turn * TURN_US
    ranks = _rank(keys, turn)
    n = int(np.lexsort((ranks, is_newcomer))[0])
    return TurnCandidate(-turn, bool(is_newcomer[n]), int(ranks[n]), _point(points[n]))


def _rank(keys: npt.NDArray[np.uint64], turn: int) -> npt.NDArray[np.uint64]:
    return _mix(keys ^ _mix(np.array([turn], np.uint64)))


def _mix(values: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Return a bijective hash of each value (Steele et al. 2014, SplitMix64)."""
    mixed = values + np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return mixed ^ (mixed >> np.uint64(31))


def _point(row: Integers) -> Point:
    x, y, z = row.tolist()
    return x, y, z
