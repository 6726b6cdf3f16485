"""Registry of live replicas in the key-value store.

Each replica writes a counter under its own key every second. What belongs to a replica (a session, a lease) names it,
and may be taken over, by a compare-and-set, once its heartbeats have stopped (`bunraku.messaging.heartbeat_observer`).
A replica that cannot reach the store declares no other replica dead.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable
from dataclasses import dataclass

from bunraku.messaging.heartbeat_observer import HeartbeatObserver
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
        self._observer = HeartbeatObserver(timing.timeout_s)
        self._handlers: list[Callable[[], None]] = []

    @property
    def key(self) -> str:
        """Key of this replica's counter."""
        return f"{REPLICA_KEY_PREFIX}.{self.id}"

    @property
    def _has_observed(self) -> bool:
        return self._observer.last_observation_s is not None

    def on_heartbeat(self, handler: Callable[[], None]) -> None:
        """Call `handler` after each heartbeat, when the liveness of all replicas is known again."""
        self._handlers.append(handler)

    def is_alive(self, replica: str) -> bool:
        """Return whether a replica was alive at the last heartbeat; True before the first, as nothing is known yet."""
        if replica in (self.id, NO_REPLICA) or not self._has_observed:
            return replica != NO_REPLICA
        if self._observer.is_known(replica):
            return not self._observer.has_stopped(replica)
        # it may have registered since the last heartbeat
        return f"{REPLICA_KEY_PREFIX}.{replica}" in self._key_values.watch().entries

    def list_alive(self) -> set[str]:
        """Return the ids of all live replicas; raise `BackendUnavailable` before the first heartbeat."""
        if not self._has_observed:
            raise BackendUnavailable("the register", "no heartbeat has succeeded yet")
        return {self.id, *filter(self.is_alive, self._list_counters())}

    async def register(self) -> str:
        """Return the id of this replica once the others know it; raise `BackendUnavailable`.

        Register before writing the id anywhere: an unknown owner is not alive.
        """
        if not self._has_observed:
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
            counters = self._list_counters()
            self._observer.observe({replica: entry.revision for replica, entry in counters.items()}, now_s)
            await self._remove_stale_counters(counters)
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

    async def _remove_stale_counters(self, counters: dict[str, KeyValueEntry]) -> None:
        for replica, entry in counters.items():
            if self._observer.silence_s(replica) > self._timing.removal_s:
                # another replica may have removed it, or it is back
                with contextlib.suppress(RevisionConflict):
                    await self._key_values.remove(f"{REPLICA_KEY_PREFIX}.{replica}", entry.revision)
