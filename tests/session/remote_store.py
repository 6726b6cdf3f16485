"""Key-value store of one replica on a server that others use too: calls, answers and changes can be late or lost."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from random import Random
from typing import TypeVar

from bunraku.messaging.key_value import KeyValueEntry, KeyValueView, MemoryKeyValueStore
from bunraku.runtime.availability import BackendUnavailable

Result = TypeVar("Result")


class RemoteKeyValueStore:
    """Connection to `server` with scripted and random faults. A fault is named `operation key-prefix`."""

    def __init__(self, server: MemoryKeyValueStore, random: Random | None = None, max_delay_s: float = 0.0) -> None:
        self.server = server
        self.held_calls: dict[str, asyncio.Event] = {}
        """Calls that reach the server only when the event is set."""
        self.lost_answers: dict[str, int] = {}
        """Number of answers that get lost after the server has carried out the call."""
        self.loss = 0.0
        """Share of all answers that get lost."""
        self._random, self._max_delay_s = random or Random(0), max_delay_s
        self._view = KeyValueView()
        self._changes: asyncio.Queue[tuple[str, KeyValueEntry | None, int]] = asyncio.Queue()
        self.watch_released = asyncio.Event()
        """Cleared to hold back the changes of the watch."""
        self.watch_released.set()
        self._subscription = server.watch().on_change(
            lambda key, entry: self._changes.put_nowait((key, entry, server.watch().revision))
        )
        self._watching = asyncio.create_task(self._follow())

    async def _follow(self) -> None:
        while True:
            change = await self._changes.get()
            await self._delay()
            await self.watch_released.wait()
            self._view.apply(*change)

    async def _delay(self) -> None:
        await asyncio.sleep(self._random.random() * self._max_delay_s)

    async def _call(self, name: str, operation: Callable[[], Awaitable[Result]]) -> Result:
        await self._delay()
        for fault, event in self.held_calls.items():
            if name.startswith(fault):
                await event.wait()
        result = await operation()
        await self._delay()
        for fault, remaining in self.lost_answers.items():
            if name.startswith(fault) and remaining:
                self.lost_answers[fault] -= 1
                raise BackendUnavailable("the register", "the answer was lost")
        if self._random.random() < self.loss:
            raise BackendUnavailable("the register", "the answer was lost")
        return result

    async def get(self, key: str) -> KeyValueEntry | None:
        return await self._call(f"get {key}", lambda: self.server.get(key))

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        return await self._call(f"put {key}", lambda: self.server.put(key, value, revision))

    async def remove(self, key: str, revision: int | None = None) -> None:
        await self._call(f"remove {key}", lambda: self.server.remove(key, revision))

    def watch(self) -> KeyValueView:
        return self._view

    async def synchronise(self) -> None:
        await self._view.wait_for(self.server.watch().revision)

    async def close(self) -> None:
        self._subscription.unsubscribe()
        self._watching.cancel()
        await asyncio.wait((self._watching,))
