"""Pulls of this replica's viewers on the open limbs of one session, summarised and published to its owner.

While anybody pulls, the summary of each pulled limb is published every `SUMMARY_INTERVAL_S` on `session.{id}.crowd`,
and once more, empty, when nobody pulls it any longer. The size of a summary does not depend on the number of viewers.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

import msgpack

from bunraku.marionette.crowd.pulls import CrowdPulls
from bunraku.wire.messages import CrowdTurn, Presence, Pull

SUMMARY_INTERVAL_S = 0.05

Member = TypeVar("Member", bound=Hashable)


class CrowdRelay(Generic[Member]):
    """Members of the crowd of one session at this replica, usually viewers."""

    def __init__(self, replica: str, clock: Callable[[], int], publish: Callable[[bytes], None]) -> None:
        """`clock` returns microseconds; `publish` sends a summary to the owner."""
        self._replica = replica
        self._clock = clock
        self._publish = publish
        self._open_limbs: frozenset[int] = frozenset()
        self._pulls: dict[int, CrowdPulls] = {}
        # random, so that no client can choose its turns
        self._keys: dict[Member, int] = {}
        self._turns: dict[int, Member] = {}
        self._timer: asyncio.TimerHandle | None = None

    def set_presence(self, presence: Presence) -> None:
        """Accept pulls on the limbs that are open now."""
        self._open_limbs = frozenset(entry["limb"] for entry in presence.crowd or ())
        self._pulls = {limb: pulls for limb, pulls in self._pulls.items() if limb in self._open_limbs}

    def pull(self, member: Member, message: Pull) -> None:
        """Record a member's pull; it has no effect on a limb that is not open."""
        if message.limb not in self._open_limbs:
            return
        key = self._keys.get(member)
        if key is None:
            key = self._keys[member] = secrets.randbits(64)
        pulls = self._pulls.get(message.limb)
        if pulls is None:
            pulls = self._pulls[message.limb] = CrowdPulls(message.limb)
        x, y, z = message.place
        pulls.pull(key, (x, y, z), self._clock())
        if self._timer is None:
            self._schedule()

    def leave(self, member: Member) -> None:
        """Forget a member."""
        self._turns = {limb: other for limb, other in self._turns.items() if other is not member}
        key = self._keys.pop(member, None)
        if key is not None:
            for pulls in self._pulls.values():
                pulls.leave(key)

    def receive_turn(self, message: bytes) -> list[tuple[Member, CrowdTurn]]:
        """Return what to send to the members here whose turn ends or begins, as the owner has published."""
        limb, turn, rank = msgpack.unpackb(message)[:3]
        pulls = self._pulls.get(limb)
        key = None if rank is None or pulls is None else pulls.find_rank(turn, rank)
        before, member = self._turns.pop(limb, None), None
        if key is not None:
            member = next(one for one, its_key in self._keys.items() if its_key == key)
            self._turns[limb] = member
        changes = ((before, False), (member, True)) if before is not member else ()
        return [(one, CrowdTurn(limb, yours)) for one, yours in changes if one is not None]

    def close(self) -> None:
        """Publish nothing more."""
        if self._timer is not None:
            self._timer.cancel()
        self._pulls.clear()

    def _schedule(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(SUMMARY_INTERVAL_S, self._publish_summaries)

    def _publish_summaries(self) -> None:
        self._timer = None
        for limb, pulls in tuple(self._pulls.items()):
            now = self._clock()
            summary = pulls.summarise(now)
            if summary.count == 0:
                del self._pulls[limb]
            self._publish(msgpack.packb([self._replica, limb, now, summary.pack()]))
        if self._pulls:
            self._schedule()
