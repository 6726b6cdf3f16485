"""Leases in the key-value store: work that one replica does at a time."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

from bunraku.messaging.key_value import KeyValueStore, RevisionConflict
from bunraku.runtime.availability import BackendUnavailable

HEARTBEAT_INTERVAL_S = 1.0
LEASE_TIMEOUT_S = 5.0
POLL_INTERVAL_S = 0.25

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class LeaseTiming:
    """Intervals of a lease, in seconds; all replicas must use the same."""

    heartbeat_s: float = HEARTBEAT_INTERVAL_S
    """Interval between heartbeats of the holder."""
    timeout_s: float = LEASE_TIMEOUT_S
    """Time without a heartbeat after which another replica may take the lease."""
    poll_s: float = POLL_INTERVAL_S
    """Interval at which waiting replicas look for heartbeats."""
    clock: Callable[[], float] = time.monotonic
    """Clock that measures the timeout, seconds."""


DEFAULT_TIMING = LeaseTiming()


@asynccontextmanager
async def hold_lease(key_values: KeyValueStore, key: str, timing: LeaseTiming = DEFAULT_TIMING) -> AsyncIterator[None]:
    """Wait for the lease at `key` and hold it inside the block.

    A replica whose event loop is blocked for longer than the timeout loses the lease without noticing: use leases to
    avoid duplicate work, not to protect data. Raise `BackendUnavailable` if the store is unavailable at the start.
    """
    holder_token = secrets.token_bytes(8)
    revision = await _acquire_lease(key_values, key, holder_token, timing)
    renewing = asyncio.create_task(_renew_lease(key_values, key, holder_token, revision, timing), name=f"lease {key}")
    try:
        yield
    finally:
        renewing.cancel()
        await asyncio.wait((renewing,))
        with contextlib.suppress(RevisionConflict, BackendUnavailable):
            current = await key_values.get(key)
            if current is not None and current.value == holder_token:
                await key_values.remove(key, current.revision)


async def _acquire_lease(key_values: KeyValueStore, key: str, holder_token: bytes, timing: LeaseTiming) -> int:
    """Wait for the lease and return the revision of its entry."""
    last_revision, last_change = 0, timing.clock()
    while True:
        current, now = await key_values.get(key), timing.clock()
        with contextlib.suppress(RevisionConflict):
            if current is None:
                return await key_values.put(key, holder_token, 0)
            if current.revision != last_revision:
                last_revision, last_change = current.revision, now
            elif now - last_change > timing.timeout_s:
                return await key_values.put(key, holder_token, last_revision)
        await asyncio.sleep(timing.poll_s)


async def _renew_lease(
    key_values: KeyValueStore, key: str, holder_token: bytes, revision: int, timing: LeaseTiming
) -> None:
    while True:
        await asyncio.sleep(timing.heartbeat_s)
        try:
            revision = await key_values.put(key, holder_token, revision)
        except BackendUnavailable as error:
            _log.warning("Lease %s not renewed: %s; trying again", key, error)
        except RevisionConflict:
            current = await key_values.get(key)
            if current is None or current.value != holder_token:
                _log.warning("Lease %s lost to another replica", key)
                return
            # the write that was reported as failed had succeeded
            revision = current.revision
