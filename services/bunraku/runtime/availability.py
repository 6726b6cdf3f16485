"""Errors and time limits for backends that do not respond."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Any, TypeVar

BACKEND_TIMEOUT_S = 1.8
"""Time after which the catalogue, the library or the bus counts as unavailable, in seconds: clients get an answer
within two seconds."""
STALL_GRACE_S = 0.3
"""Last part of a timeout, in seconds, in which an event loop that was blocked still reads answers that arrived."""

Result = TypeVar("Result")


class BackendUnavailable(Exception):
    """A backend (`the catalogue`, `the library`, `the bus`, `the register`) that cannot be used now.

    Over HTTP it becomes a 503; the same request may be repeated.
    """

    def __init__(self, backend: str, reason: str) -> None:
        """`reason` is for the log only, as it may contain addresses."""
        super().__init__(f"{backend} is unavailable: {reason}")
        self.backend = backend


class BackendTimeout:
    """Time limit for the calls of one backend.

    A call that exceeds it is cancelled and finishes in the background: closing a connection to a backend that does
    not respond takes time.
    """

    def __init__(self, backend: str) -> None:
        self._backend = backend
        self._abandoned: set[asyncio.Future[Any]] = set()

    async def wait(self, awaitable: Awaitable[Result], timeout_s: float | None = BACKEND_TIMEOUT_S) -> Result:
        """Return the result of `awaitable`; raise `BackendUnavailable` after `timeout_s` seconds (None: no limit)."""
        task = asyncio.ensure_future(awaitable)
        try:
            for part in (None,) if timeout_s is None else (timeout_s - STALL_GRACE_S, STALL_GRACE_S):
                await asyncio.wait((task,), timeout=part)
                if task.done():
                    return task.result()
        finally:
            if not task.done():
                task.cancel()
                self._abandoned.add(task)
                task.add_done_callback(self._discard_abandoned)
        raise BackendUnavailable(self._backend, f"no answer within {timeout_s:g} s")

    async def drain_abandoned(self) -> None:
        """Wait for abandoned calls to finish, at most `BACKEND_TIMEOUT_S`."""
        if self._abandoned:
            await asyncio.wait(tuple(self._abandoned), timeout=BACKEND_TIMEOUT_S)

    def _discard_abandoned(self, task: asyncio.Future[Any]) -> None:
        self._abandoned.discard(task)
        if not task.cancelled():
            # retrieve the exception, so that asyncio does not log it: the caller got its own
            task.exception()
