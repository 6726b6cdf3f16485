"""Work that one replica at a time does: a lease in the register, which others wait for, and take from who is gone."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from bunraku.backing.register import Conflict, Register
from bunraku.backing.unavailable import Unavailable

BEAT = 1.0
"""Seconds between two signs of life of who has a lease."""
EXPIRED = 5.0
"""Seconds without one after which it is anybody's."""
ASKED = 0.25
"""Seconds between two looks of one who waits."""

_log = logging.getLogger(__name__)


@asynccontextmanager
async def alone(register: Register, key: str) -> AsyncIterator[None]:
    """While this lasts no other replica is where this one is, at `key`; until then it is waited for.

    One that stood still for `EXPIRED` may find another beside it: what is done here must bear that, as it saves work
    and guards nothing. Raises `Unavailable` where the register is away at the beginning.
    """
    mine = secrets.token_bytes(8)
    beating = asyncio.create_task(_beat(register, key, mine, await _take(register, key, mine)), name=f"lease {key}")
    try:
        yield
    finally:
        beating.cancel()
        await asyncio.wait((beating,))
        with contextlib.suppress(Conflict, Unavailable):
            found = await register.get(key)
            if found is not None and found.value == mine:
                await register.remove(key, found.revision)


async def _take(register: Register, key: str, mine: bytes) -> int:
    """The revision at which it is ours."""
    seen, since = 0, time.monotonic()
    while True:
        found, now = await register.get(key), time.monotonic()
        with contextlib.suppress(Conflict):
            if found is None:
                return await register.put(key, mine, 0)
            if found.revision != seen:
                seen, since = found.revision, now
            elif now - since > EXPIRED:
                return await register.put(key, mine, seen)
        await asyncio.sleep(ASKED)


async def _beat(register: Register, key: str, mine: bytes, revision: int) -> None:
    while True:
        await asyncio.sleep(BEAT)
        try:
            revision = await register.put(key, mine, revision)
        except Unavailable as error:
            _log.warning("%s; trying again", error)
        except Conflict:
            found = await register.get(key)
            if found is None or found.value != mine:
                _log.warning("another replica has taken the lease %s", key)
                return
            # what was said to have failed had been done
            revision = found.revision
