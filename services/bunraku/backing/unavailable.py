"""What a service says when something that it stands on does not answer."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Any, TypeVar

ANSWERED = 1.8
"""Seconds after which the catalogue, the library or the bus counts as gone: who asked a service hears it within two."""
GRACE = 0.3
"""Of these, those in which a loop that stood still reads what came meanwhile."""

Found = TypeVar("Found")


class Unavailable(Exception):
    """The catalogue, the library or the bus cannot be used now; `what` names which. Over HTTP it is a 503, and the same
    request may be sent again."""

    def __init__(self, what: str, why: str) -> None:
        """`why` is for the log, as it may name addresses."""
        super().__init__(f"{what} cannot be used now: {why}")
        self.what = what


class Patience:
    """Waits for answers no longer than it should. What is given up is cancelled at once and ends behind the back of who
    asked, as putting a connection in order takes a while where nobody answers."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._late: set[asyncio.Future[Any]] = set()

    async def wait(self, asked: Awaitable[Found], seconds: float | None = ANSWERED) -> Found:
        """What is `asked`; raises `Unavailable` after `seconds`, not before where these are None."""
        task = asyncio.ensure_future(asked)
        try:
            for part in (None,) if seconds is None else (seconds - GRACE, GRACE):
                await asyncio.wait((task,), timeout=part)
                if task.done():
                    return task.result()
        finally:
            if not task.done():
                task.cancel()
                self._late.add(task)
                task.add_done_callback(self._forget)
        raise Unavailable(self._what, "no answer in time")

    async def end(self) -> None:
        """Give what was given up a last chance to end."""
        if self._late:
            await asyncio.wait(tuple(self._late), timeout=ANSWERED)

    def _forget(self, task: asyncio.Future[Any]) -> None:
        self._late.discard(task)
        if not task.cancelled():
            # looked at, so that nobody warns of it: who asked was told already
            task.exception()
