"""Work that one replica at a time does: a lease in the register, which others wait for, and take from who is gone."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from bunraku.messaging.key_value import KeyValueStore, RevisionConflict
from bunraku.runtime.availability import BackendUnavailable

HEARTBEAT_INTERVAL_S = 1.0
"""Seconds between two signs of life of who has a lease."""
LEASE_TIMEOUT_S = 5.0
"""Seconds without one after which it is anybody's."""
POLL_INTERVAL_S = 0.25
"""Seconds between two looks of one who waits."""

_log = logging.getLogger(__name__)


@asynccontextmanager
async def hold_lease(key_values: KeyValueStore, key: str) -> AsyncIterator[None]:
    """While this lasts no other replica is where this one is, at `key`; until then it is waited for.

    One that stood still for `EXPIRED` may find another beside it: what is done here must bear that, as it saves work
    and guards nothing. Raises `Unavailable` where the register is away at the beginning.
    """
    mine = secrets.token_bytes(8)
    beating = asyncio.create_task(
        _renew_lease(key_values, key, mine, await _acquire_lease(key_values, key, mine)), name=f"lease {key}"
    )
    try:
        yield
    finally:
        beating.cancel()
        await asyncio.wait((beating,))
        with contextlib.suppress(RevisionConflict, BackendUnavailable):
            found = await key_values.get(key)
            if found is not None and found.value == mine:
                await key_values.remove(key, found.revision)


async def _acquire_lease(key_values: KeyValueStore, key: str, holder_token: bytes) -> int:
    """The revision at which it is ours."""
    seen, since = 0, time.monotonic()
    while True:
        found, now = await key_values.get(key), time.monotonic()
        with contextlib.suppress(RevisionConflict):
            if found is None:
                return await key_values.put(key, holder_token, 0)
            if found.revision != seen:
                seen, since = found.revision, now
            elif now - since > LEASE_TIMEOUT_S:
                return await key_values.put(key, holder_token, seen)
        await asyncio.sleep(POLL_INTERVAL_S)


async def _renew_lease(key_values: KeyValueStore, key: str, holder_token: bytes, revision: int) -> None:
    while True:
        await asyncio.sleep(HEARTBEAT_INTERVAL_S)
        try:
            revision = await key_values.put(key, holder_token, revision)
        except BackendUnavailable as error:
            _log.warning("%s; trying again", error)
        except RevisionConflict:
            found = await key_values.get(key)
            if found is None or found.value != holder_token:
                _log.warning("another replica has taken the lease %s", key)
                return
            # what was said to have failed had been done
            revision = found.revision
