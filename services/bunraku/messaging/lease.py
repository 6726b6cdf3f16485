"""Leases in the key-value store: work that one replica does at a time."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from bunraku.messaging.key_value import KeyValueEntry, KeyValueStore, RevisionConflict
from bunraku.messaging.replica_registry import ReplicaRegistry, ReplicaTiming
from bunraku.runtime.availability import BackendUnavailable

LEASE_TIMING = ReplicaTiming(timeout_s=5.0)
"""Intervals of a lease: its holder may be busy, and nobody is harmed by waiting."""
POLL_INTERVAL_S = 0.25
"""Interval at which a waiting replica looks at the lease, in seconds."""


@asynccontextmanager
async def hold_lease(
    key_values: KeyValueStore, key: str, timing: ReplicaTiming = LEASE_TIMING, poll_s: float = POLL_INTERVAL_S
) -> AsyncIterator[None]:
    """Wait for the lease at `key` and hold it inside the block.

    The holder registers as a replica for that time, so that a lease that was not released ends with its heartbeats. A
    replica whose event loop is blocked for longer than the timeout loses the lease without noticing: use leases to
    avoid duplicate work, not to protect data. Raise `BackendUnavailable` if the store is unavailable at the start.
    """
    async with _register(key_values, key, timing) as holder:
        revision = await _acquire_lease(key_values, key, holder, poll_s)
        try:
            yield
        finally:
            with contextlib.suppress(RevisionConflict, BackendUnavailable):
                await key_values.remove(key, revision)


async def wait_until_abandoned(key_values: KeyValueStore, key: str, timing: ReplicaTiming = LEASE_TIMING) -> None:
    """Wait until the heartbeats of the holder of the lease at `key` have stopped.

    Wait for a holder first. Raise `BackendUnavailable` if the store is unavailable at the start.
    """
    async with _register(key_values, key, timing) as observer:
        entries, has_observed = key_values.watch().entries, asyncio.Event()
        observer.on_heartbeat(has_observed.set)
        while key not in entries or observer.is_alive(_holder_of(entries[key])):
            has_observed.clear()
            await has_observed.wait()


@asynccontextmanager
async def _register(key_values: KeyValueStore, key: str, timing: ReplicaTiming) -> AsyncIterator[ReplicaRegistry]:
    """Register a replica, which observes the others, inside the block."""
    replica = ReplicaRegistry(key_values, timing)
    await replica.register()
    heartbeats = asyncio.create_task(replica.run(), name=f"lease {key}")
    try:
        yield replica
    finally:
        heartbeats.cancel()
        await asyncio.wait((heartbeats,))
        await replica.close()


async def _acquire_lease(key_values: KeyValueStore, key: str, holder: ReplicaRegistry, poll_s: float) -> int:
    """Wait for the lease and return the revision of its entry."""
    while True:
        current = await key_values.get(key)
        with contextlib.suppress(RevisionConflict):
            if current is None:
                return await key_values.put(key, holder.id.encode(), 0)
            if not holder.is_alive(_holder_of(current)):
                return await key_values.put(key, holder.id.encode(), current.revision)
        await asyncio.sleep(poll_s)


def _holder_of(entry: KeyValueEntry) -> str:
    """Return the id of the replica that holds a lease."""
    return entry.value.decode("ascii", "replace")
