"""What a service says when something that it stands on does not answer."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Any, TypeVar

BACKEND_TIMEOUT_S = 1.8
"""Seconds after which the catalogue, the library or the bus counts as gone: who asked a service hears it within two."""
STALL_GRACE_S = 0.3
"""Of these, those in which a loop that stood still reads what came meanwhile."""

Found = TypeVar("Found")


class BackendUnavailable(Exception):
    """The catalogue, the library or the bus cannot be used now; `what` names which. Over HTTP it is a 503, and the same
    request may be sent again."""

    def __init__(self, backend: str, reason: str) -> None:
        """`why` is for the log, as it may name addresses."""
        super().__init__(f"{backend} cannot be used now: {reason}")
        self.backend = backend


class BackendTimeout:
    """Waits for answers no longer than it should. What is given up is cancelled at once and ends behind the back of who
    asked, as putting a connection in order takes a while where nobody answers."""

    def __init__(self, backend: str) -> None:
        self._backend = backend
        self._abandoned: set[asyncio.Future[Any]] = set()

    async def wait(self, awaitable: Awaitable[Found], timeout_s: float | None = BACKEND_TIMEOUT_S) -> Found:
        """What is `asked`; raises `Unavailable` after `seconds`, not before where these are None."""
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
        raise BackendUnavailable(self._backend, "no answer in time")

    async def drain_abandoned(self) -> None:
        """Give what was given up a last chance to end."""
        if self._abandoned:
            await asyncio.wait(tuple(self._abandoned), timeout=BACKEND_TIMEOUT_S)

    def _discard_abandoned(self, task: asyncio.Future[Any]) -> None:
        self._abandoned.discard(task)
        if not task.cancelled():
            # looked at, so that nobody warns of it: who asked was told already
            task.exception()
