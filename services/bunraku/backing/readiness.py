"""Whether a process can do its work now: what it stands on is asked, and what does not answer is named."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from typing import Any, Literal

from fastapi import FastAPI

from bunraku.backing.backing import Backing
from bunraku.backing.problems import RETRY_AFTER, ProblemError
from bunraku.backing.unavailable import Unavailable

Need = Literal["bus", "register", "catalogue", "library"]
_NOTHING = "readyz"
"""A name under which nothing is kept: to ask for it is to ask whether somebody answers."""


class Readiness:
    """That of one process, upon what it `needs` of its backing. `waiting` are what it prepares before it is of use, in
    words; who prepares it takes them out."""

    def __init__(self, backing: Backing, needs: Collection[Need]) -> None:
        self._backing = backing
        self._needs = tuple(sorted(set(needs)))
        self.waiting: set[str] = set()

    async def away(self) -> list[str]:
        """What is not there now, in words; nothing where all is. Within two seconds."""
        asked = await asyncio.gather(*map(self._asked, self._needs))
        return [*(what for what in asked if what is not None), *sorted(self.waiting)]

    async def _asked(self, need: Need) -> str | None:
        backing = self._backing
        if need == "bus":
            return None if backing.bus.up else "the bus"
        ways: dict[str, Callable[[], Awaitable[object]]] = {
            "register": lambda: backing.register.get(_NOTHING),
            "catalogue": lambda: backing.catalogue.get(_NOTHING),
            "library": backing.library.check,
        }
        try:
            await ways[need]()
        except Unavailable as error:
            return error.what
        return None


def install(app: FastAPI, readiness: Readiness) -> None:
    """Adds `/livez`, whether the process answers at all, and `/readyz`, whether it can do its work: a 503 names in
    `away` what is missing. Who is alive and not ready is not helped by being started anew."""

    @app.get("/livez", tags=["health"])
    async def alive() -> dict[str, Any]:
        """Whether this process answers."""
        return {"status": "ok"}

    @app.get("/readyz", tags=["health"])
    async def ready() -> dict[str, Any]:
        """Whether this process can do its work; a problem document says what is away."""
        away = list(dict.fromkeys(await readiness.away()))
        if away:
            raise ProblemError(
                503, "Not ready", f"not there: {', '.join(away)}", away=away, hint=f"ask again in {RETRY_AFTER} s"
            )
        return {"status": "ready"}
