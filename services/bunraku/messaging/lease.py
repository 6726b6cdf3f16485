"""Leases in the key-value store: work that one replica does at a time."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from bunraku.messaging.key_value import KeyValueStore, RevisionConflict
from bunraku.messaging.replica_registry import DEFAULT_TIMING, ReplicaRegistry, ReplicaTiming
from bunraku.runtime.availability import BackendUnavailable

POLL_INTERVAL_S = 0.25
"""Interval at which a waiting replica looks at the lease, in seconds."""


@asynccontextmanager
async def hold_lease(
    key_values: KeyValueStore, key: str, timing: ReplicaTiming = DEFAULT_TIMING, poll_s: float = POLL_INTERVAL_S
) -> AsyncIterator[None]:
    """Wait for the lease at `key` and hold it inside the block.

    The holder registers as a replica for that time, so that a lease that was not released ends with its heartbeats. A
    replica whose event loop is blocked for longer than the timeout loses the lease without noticing: use leases to
    avoid duplicate work, not to protect data. Raise `BackendUnavailable` if the store is unavailable at the start.
    """
    holder = ReplicaRegistry(key_values, timing)
    await holder.register()
    heartbeats = asyncio.create_task(holder.run(), name=f"lease {key}")
    try:
        revision = await _acquire_lease(key_values, key, holder, poll_s)
        try:
            yield
        finally:
            with contextlib.suppress(RevisionConflict, BackendUnavailable):
                await key_values.remove(key, revision)
    finally:
        heartbeats.cancel()
        await asyncio.wait((heartbeats,))
        await holder.close()


async def _acquire_lease(key_values: KeyValueStore, key: str, holder: ReplicaRegistry, poll_s: float) -> int:
    """Wait for the lease and return the revision of its entry."""
    while True:
        current = await key_values.get(key)
        with contextlib.suppress(RevisionConflict):
            if current is None:
                return await key_values.put(key, holder.id.encode(), 0)
            if not holder.is_alive(current.value.decode("ascii", "replace")):
                return await key_values.put(key, holder.id.encode(), current.revision)
        await asyncio.sleep(poll_s)
