from __future__ import annotations

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from bunraku.websocket.subprotocol import CloseConnection, run_until_first_ends


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

    await run_until_first_ends(for_ever(), leaves())
    assert ended.is_set()


async def test_what_went_wrong_is_raised() -> None:
    async def for_ever() -> None:
        await asyncio.Event().wait()

    async def refuses() -> None:
        raise CloseConnection(1008, "Broken", "so it is")

    with pytest.raises(CloseConnection, match="so it is"):
        await run_until_first_ends(refuses(), for_ever())
