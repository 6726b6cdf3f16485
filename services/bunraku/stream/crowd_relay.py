"""Pulls of this replica's viewers on the open limbs of one session, summarised and published to its owner.

While anybody pulls, the summary of each pulled limb is published every `SUMMARY_INTERVAL_S` on `session.{id}.crowd`,
and once more, empty, when nobody pulls it any longer. The size of a summary does not depend on the number of viewers.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable

import msgpack

from bunraku.marionette.crowd.pulls import CrowdPulls
from bunraku.wire.messages import Presence, Pull

SUMMARY_INTERVAL_S = 0.05


class CrowdRelay:
    """Members of the crowd of one session at this replica: any objects, usually viewers."""

    def __init__(self, replica: str, clock: Callable[[], int], publish: Callable[[bytes], None]) -> None:
        """`clock` returns microseconds; `publish` sends a summary to the owner."""
        self._replica = replica
        self._clock = clock
        self._publish = publish
        self._open_limbs: frozenset[int] = frozenset()
        self._pulls: dict[int, CrowdPulls] = {}
        # random, so that no client can choose its turns
        self._keys: dict[object, int] = {}
        self._timer: asyncio.TimerHandle | None = None

    def set_presence(self, presence: Presence) -> None:
        """Accept pulls on the limbs that are open now."""
        self._open_limbs = frozenset(entry["limb"] for entry in presence.crowd or ())
        self._pulls = {limb: pulls for limb, pulls in self._pulls.items() if limb in self._open_limbs}

    def pull(self, member: object, message: Pull) -> None:
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

    def leave(self, member: object) -> None:
        """Forget a member."""
        key = self._keys.pop(member, None)
        if key is not None:
            for pulls in self._pulls.values():
                pulls.leave(key)

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
