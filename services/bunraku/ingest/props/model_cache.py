"""Most recently wanted models of props, so that a large audience costs the catalogue one query."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from weakref import WeakValueDictionary

MAX_CACHED_MODELS = 32
"""Models that are kept: at most 2.5 MB each, most of them less than 0.1 MB."""
MAX_AGE_S = 60.0
"""Time after which a model is loaded again: another replica may have removed the prop."""


class ModelCache:
    """Models of props, as they are stored; each is loaded by one request while the others for it wait."""

    def __init__(
        self, load: Callable[[str], Awaitable[bytes | None]], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """`load` returns the model of a prop, None if it does not exist; `clock` the time in seconds."""
        self._load = load
        self._clock = clock
        self._models: OrderedDict[str, tuple[bytes, float]] = OrderedDict()
        self._locks: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    async def get(self, prop: str) -> bytes | None:
        """Return the model of a prop, None if it does not exist; raise as `load` does."""
        async with self._locks.setdefault(prop, asyncio.Lock()):
            known = self._models.get(prop)
            if known is None or self._clock() - known[1] > MAX_AGE_S:
                loaded = await self._load(prop)
                if loaded is None:
                    self.forget(prop)
                    return None
                self._models[prop] = loaded, self._clock()
                if len(self._models) > MAX_CACHED_MODELS:
                    self._models.popitem(last=False)
            self._models.move_to_end(prop)
            return self._models[prop][0]

    def forget(self, prop: str) -> None:
        """Drop a model that was removed."""
        self._models.pop(prop, None)
