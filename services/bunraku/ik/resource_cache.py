"""Cache of tables and figures, which are built one at a time and for each client at a bounded rate."""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass

from starlette.requests import Request

from bunraku.http.access_control import Role, access_of
from bunraku.http.admission import network_of
from bunraku.http.token_bucket import KeyedTokenBuckets
from bunraku.runtime.problem import ProblemError

MAX_CACHED_RESOURCES = 256
"""Cached tables and figures: at most 8 MB."""
BUILDS_PER_S = 0.5
"""Resources that are not cached and that one client may request per second. A processor needs about 70 ms for a table
and 400 ms for a figure."""
BUILD_BURST = 20.0
"""Builds at once: a client needs a table for each performer."""


@dataclass(frozen=True, slots=True)
class CachedResource:
    """Bytes of a resource and their strong entity tag."""

    data: bytes
    etag: str

    @classmethod
    def from_bytes(cls, data: bytes) -> CachedResource:
        """Return the resource with these bytes."""
        return cls(data, f'"{hashlib.sha256(data).hexdigest()[:32]}"')


class ResourceCache:
    """The most recently used resources. `clock` returns seconds and is monotonic.

    A client is a subject at one address: the viewers of one link are one subject. So neither another subject nor
    another viewer with the same link can use up a client's builds, or replace the cache faster than it can be filled
    again. The role admin, which every client of a server without a secret has, is not limited.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._resources: OrderedDict[Hashable, CachedResource] = OrderedDict()
        self._builds = KeyedTokenBuckets(BUILDS_PER_S, BUILD_BURST)
        self._building = asyncio.Semaphore(1)

    async def get(self, request: Request, key: Hashable, build: Callable[[], bytes]) -> CachedResource:
        """Return the resource of `key`, built in a thread if it is not cached. Raises `ProblemError` 429."""
        if key not in self._resources:
            self._limit_builds(request)
            # the event loop stays free, and other threads get their share
            async with self._building:
                if key not in self._resources:
                    self._store(key, CachedResource.from_bytes(await asyncio.to_thread(build)))
        self._resources.move_to_end(key)
        return self._resources[key]

    def _store(self, key: Hashable, resource: CachedResource) -> None:
        if len(self._resources) >= MAX_CACHED_RESOURCES:
            self._resources.popitem(last=False)
        self._resources[key] = resource

    def _limit_builds(self, request: Request) -> None:
        access = access_of(request)
        network = network_of(request)
        if access.role < Role.ADMIN and not self._builds.take(f"{access.subject}\n{network}", self._clock()):
            raise ProblemError(
                429,
                "Too many arms",
                "you requested tables or figures of too many arms that nobody used of late",
                hint=f"request at most one every {1.0 / BUILDS_PER_S:g} s, and keep them: they never change",
            )
