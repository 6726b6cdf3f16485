"""Registry of live replicas: the one lease mechanism of the deployment.

Each replica writes a counter under its own key every second. What belongs to a replica (a session, a job, a lease)
names it, and may be taken over, by a compare-and-set, once the replica is no longer alive. Staleness is judged by the
observer's own monotonic clock and by its own heartbeats, never by a time that another machine has written: a replica
that cannot reach the store declares no other replica dead.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable
from dataclasses import dataclass

from bunraku.messaging.key_value import KeyValueEntry, KeyValueStore, RevisionConflict
from bunraku.runtime.availability import BackendUnavailable

REPLICA_KEY_PREFIX = "replicas"
"""Prefix of `replicas.{id}`: heartbeat counter of a replica."""
NO_REPLICA = ""
"""Owner of what its replica has handed over."""
HEARTBEAT_INTERVAL_S = 1.0
REPLICA_TIMEOUT_S = 2.5
"""Time without a heartbeat after which a replica is no longer alive."""
REPLICA_REMOVAL_S = 60.0
"""Time without a heartbeat after which a replica's counter is removed."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ReplicaTiming:
    """Intervals of a registry, in seconds; all replicas must use the same."""

    heartbeat_s: float = HEARTBEAT_INTERVAL_S
    timeout_s: float = REPLICA_TIMEOUT_S
    removal_s: float = REPLICA_REMOVAL_S


DEFAULT_TIMING = ReplicaTiming()


class ReplicaRegistry:
    """Registration of one replica, and its observation of the others."""

    def __init__(self, key_values: KeyValueStore, timing: ReplicaTiming = DEFAULT_TIMING) -> None:
        self.id = secrets.token_hex(6)
        """Name of this replica, new at each start."""
        self._key_values = key_values
        self._timing = timing
        self._heartbeat_count = 0
        self._heartbeat_lock = asyncio.Lock()
        # by replica: the newest revision of its counter, and the time of the own heartbeat that first saw it
        self._observed: dict[str, tuple[int, float]] = {}
        self._observed_at_s: float | None = None
        self._handlers: list[Callable[[], None]] = []

    @property
    def key(self) -> str:
        """Key of this replica's counter."""
        return f"{REPLICA_KEY_PREFIX}.{self.id}"

    def on_heartbeat(self, handler: Callable[[], None]) -> None:
        """Call `handler` after each heartbeat, when the liveness of all replicas is known again."""
        self._handlers.append(handler)

    def is_alive(self, replica: str) -> bool:
        """Return whether a replica was alive at the last heartbeat; True before the first, as nothing is known yet."""
        if replica in (self.id, NO_REPLICA) or self._observed_at_s is None:
            return replica != NO_REPLICA
        observed = self._observed.get(replica)
        if observed is None:
            # it may have registered since the last heartbeat
            return f"{REPLICA_KEY_PREFIX}.{replica}" in self._key_values.watch().entries
        return self._observed_at_s - observed[1] <= self._timing.timeout_s

    def list_alive(self) -> set[str]:
        """Return the ids of all live replicas; raise `BackendUnavailable` before the first heartbeat."""
        if self._observed_at_s is None:
            raise BackendUnavailable("the register", "no heartbeat has succeeded yet")
        return {self.id, *filter(self.is_alive, self._list_counters())}

    async def register(self) -> str:
        """Return the id of this replica once the others know it; raise `BackendUnavailable`.

        Register before writing the id anywhere: an unknown owner is not alive.
        """
        if self._observed_at_s is None:
            await self.send_heartbeat()
        return self.id

    async def run(self) -> None:
        """Send heartbeats until cancelled."""
        loop, is_outage_logged = asyncio.get_running_loop(), False
        while True:
            begin_s = loop.time()
            try:
                await self.send_heartbeat()
                is_outage_logged = False
            except BackendUnavailable as error:
                if not is_outage_logged:
                    _log.warning("%s; trying again", error)
                is_outage_logged = True
            except Exception:
                _log.exception("A heartbeat failed; trying again")
            await asyncio.sleep(max(begin_s + self._timing.heartbeat_s - loop.time(), self._timing.heartbeat_s / 4))

    async def send_heartbeat(self) -> None:
        """Write the counter and observe the others; raise `BackendUnavailable`.

        The observation is complete when the local copy contains the own write: everything that others wrote before it
        is contained then.
        """
        async with self._heartbeat_lock:
            self._heartbeat_count += 1
            view, now_s = self._key_values.watch(), asyncio.get_running_loop().time()
            revision = await self._key_values.put(self.key, str(self._heartbeat_count).encode())
            await view.wait_for(revision)
            # after an outage or a stall of this replica, the others get as much time again
            was_delayed = self._observed_at_s is None or now_s - self._observed_at_s > 2 * self._timing.heartbeat_s
            self._observed_at_s = now_s
            counters = self._list_counters()
            self._observed = {
                replica: self._observe(replica, entry.revision, now_s, was_delayed)
                for replica, entry in counters.items()
            }
            await self._remove_stale_counters(counters, now_s)
        for handler in self._handlers:
            handler()

    async def close(self) -> None:
        """Remove the counter, so that the others need not wait; they time out if the store is unavailable."""
        with contextlib.suppress(BackendUnavailable):
            await self._key_values.remove(self.key)

    def _list_counters(self) -> dict[str, KeyValueEntry]:
        """Return the counters of all replicas in the local copy."""
        return {
            key.partition(".")[2]: entry
            for key, entry in self._key_values.watch().entries.items()
            if key.startswith(f"{REPLICA_KEY_PREFIX}.")
        }

    def _observe(self, replica: str, revision: int, now_s: float, was_delayed: bool) -> tuple[int, float]:
        known_revision, since_s = self._observed.get(replica, (0, now_s))
        return revision, now_s if was_delayed or revision != known_revision else since_s

    async def _remove_stale_counters(self, counters: dict[str, KeyValueEntry], now_s: float) -> None:
        for replica, entry in counters.items():
            if now_s - self._observed[replica][1] > self._timing.removal_s:
                # another replica may have removed it, or it is back
                with contextlib.suppress(RevisionConflict):
                    await self._key_values.remove(f"{REPLICA_KEY_PREFIX}.{replica}", entry.revision)
