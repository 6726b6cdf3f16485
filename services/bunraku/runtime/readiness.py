"""Whether a process can do its work now: what it stands on is asked, and what does not answer is named."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from typing import Any, Literal

from fastapi import FastAPI

from bunraku.http.problem_details import RETRY_AFTER_S, ProblemError
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext

Dependency = Literal["bus", "register", "catalogue", "library"]
_PROBE_KEY = "readyz"
"""A name under which nothing is kept: to ask for it is to ask whether somebody answers."""


class Readiness:
    """That of one process, upon what it `needs` of its backing. `waiting` are what it prepares before it is of use, in
    words; who prepares it takes them out."""

    def __init__(self, context: ServiceContext, dependencies: Collection[Dependency]) -> None:
        self._context = context
        self._dependencies = tuple(sorted(set(dependencies)))
        self.pending_preparations: set[str] = set()

    async def list_unavailable(self) -> list[str]:
        """What is not there now, in words; nothing where all is. Within two seconds."""
        asked = await asyncio.gather(*map(self._check_dependency, self._dependencies))
        return [*(what for what in asked if what is not None), *sorted(self.pending_preparations)]

    async def _check_dependency(self, dependency: Dependency) -> str | None:
        backing = self._context
        if dependency == "bus":
            return None if backing.bus.is_connected else "the bus"
        ways: dict[str, Callable[[], Awaitable[object]]] = {
            "register": lambda: backing.key_values.get(_PROBE_KEY),
            "catalogue": lambda: backing.catalogue.get_motion(_PROBE_KEY),
            "library": backing.motion_store.check,
        }
        try:
            await ways[dependency]()
        except BackendUnavailable as error:
            return error.backend
        return None


def install_health_routes(app: FastAPI, readiness: Readiness) -> None:
    """Adds `/livez`, whether the process answers at all, and `/readyz`, whether it can do its work: a 503 names in
    `away` what is missing. Who is alive and not ready is not helped by being started anew."""

    @app.get("/livez", tags=["health"])
    async def alive() -> dict[str, Any]:
        """Whether this process answers."""
        return {"status": "ok"}

    @app.get("/readyz", tags=["health"])
    async def ready() -> dict[str, Any]:
        """Whether this process can do its work; a problem document says what is away."""
        away = list(dict.fromkeys(await readiness.list_unavailable()))
        if away:
            raise ProblemError(
                503, "Not ready", f"not there: {', '.join(away)}", away=away, hint=f"ask again in {RETRY_AFTER_S} s"
            )
        return {"status": "ready"}
