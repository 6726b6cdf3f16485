"""Liveness and readiness of a process (`/livez`, `/readyz`)."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from typing import Any, Literal

from fastapi import FastAPI

from bunraku.http.problem_details import RETRY_AFTER_S
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError

Dependency = Literal["bus", "register", "catalogue", "library"]
_PROBE_KEY = "readyz"
"""A key that is never stored: reading it shows whether the backend responds."""


class Readiness:
    """Readiness of one process: its dependencies respond and its preparations are complete."""

    def __init__(self, context: ServiceContext, dependencies: Collection[Dependency]) -> None:
        self._context = context
        self._dependencies = tuple(sorted(set(dependencies)))
        self.pending_preparations: set[str] = set()
        """Names of preparations that must complete first; the code that prepares removes them."""

    async def list_unavailable(self) -> list[str]:
        """Return the names of everything that is not ready, within two seconds."""
        backends = await asyncio.gather(*map(self._check_dependency, self._dependencies))
        return [*(backend for backend in backends if backend is not None), *sorted(self.pending_preparations)]

    async def _check_dependency(self, dependency: Dependency) -> str | None:
        context = self._context
        if dependency == "bus":
            return None if context.bus.is_connected else "the bus"
        probes: dict[str, Callable[[], Awaitable[object]]] = {
            "register": lambda: context.key_values.get(_PROBE_KEY),
            "catalogue": lambda: context.catalogue.get_motion(_PROBE_KEY),
            "library": context.motion_store.check,
        }
        try:
            await probes[dependency]()
        except BackendUnavailable as error:
            return error.backend
        return None


def install_health_routes(app: FastAPI, readiness: Readiness) -> None:
    """Add `/livez` (the process responds) and `/readyz` (it can serve requests).

    The 503 of `/readyz` lists the missing dependencies in `away`. Restarting a live process that is not ready does not
    help.
    """

    @app.get("/livez", tags=["health"])
    async def get_liveness() -> dict[str, Any]:
        """Return 200 while the process responds."""
        return {"status": "ok"}

    @app.get("/readyz", tags=["health"])
    async def get_readiness() -> dict[str, Any]:
        """Return 200 if the process can serve requests, else a problem document that lists unavailable dependencies."""
        unavailable = list(dict.fromkeys(await readiness.list_unavailable()))
        if unavailable:
            detail = f"unavailable: {', '.join(unavailable)}"
            raise ProblemError(503, "Not ready", detail, away=unavailable, hint=f"try again in {RETRY_AFTER_S} s")
        return {"status": "ready"}
