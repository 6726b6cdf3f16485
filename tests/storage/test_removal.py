from __future__ import annotations

import asyncio
import random
from pathlib import Path
from typing import Any

import pytest

from bunraku.ingest.persistence import store_motion
from bunraku.ingest.result import JobResult
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.storage.removal import remove_motion

RESULT = JobResult(b"packed", {})
STORE_METHODS = ("put", "remove", "object_sizes")
CATALOGUE_METHODS = ("add_motion", "remove_motion", "get_motion")


class RandomOrder:
    """Order of the operations on storage, drawn at random: each waits for its turn."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._waiting: list[asyncio.Future[None]] = []

    def delay(self, method: Any) -> Any:
        """Return `method` with a random turn before and after it."""

        async def delayed(*arguments: Any) -> Any:
            await self._wait()
            result = await method(*arguments)
            await self._wait()
            return result

        return delayed

    async def run(self, *operations: asyncio.Task[Any]) -> None:
        """Run the operations to their end."""
        while not all(operation.done() for operation in operations):
            if self._waiting:
                self._waiting.pop(self._random.randrange(len(self._waiting))).set_result(None)
            await asyncio.sleep(0)

    async def _wait(self) -> None:
        turn = asyncio.get_running_loop().create_future()
        self._waiting.append(turn)
        await turn


@pytest.mark.parametrize("seed", range(30))
async def test_stored_motion_has_its_object_whatever_is_removed_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    order = RandomOrder(seed)
    async with open_context(Settings(data=tmp_path)) as context:
        await store_motion(context, "m1", RESULT, {}, "aiko")
        with monkeypatch.context() as patch:
            for methods, owner in ((STORE_METHODS, context.motion_store), (CATALOGUE_METHODS, context.catalogue)):
                for name in methods:
                    patch.setattr(owner, name, order.delay(getattr(owner, name)))
            removal = asyncio.create_task(remove_motion(context.catalogue, context.motion_store, "m1"))
            upload = asyncio.create_task(store_motion(context, "m1", RESULT, {}, "aiko"))
            await order.run(removal, upload)
        assert await removal
        stored = (await context.motion_store.object_sizes(["m1"]))[0] is not None
        if upload.result().is_new:
            # the upload came after the removal
            assert await context.catalogue.get_motion("m1") is not None
            assert stored
        else:
            # the upload found the motion, which was removed afterwards
            assert await context.catalogue.get_motion("m1") is None
