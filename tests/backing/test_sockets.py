from __future__ import annotations

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from bunraku.backing.sockets import Refusal, converse


async def test_when_one_way_ends_so_does_the_other() -> None:
    ended = asyncio.Event()

    async def for_ever() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async def leaves() -> None:
        await asyncio.sleep(0)
        raise WebSocketDisconnect(1001)

    await converse(for_ever(), leaves())
    assert ended.is_set()


async def test_what_went_wrong_is_raised() -> None:
    async def for_ever() -> None:
        await asyncio.Event().wait()

    async def refuses() -> None:
        raise Refusal(1008, "Broken", "so it is")

    with pytest.raises(Refusal, match="so it is"):
        await converse(refuses(), for_ever())
