from __future__ import annotations

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from bunraku.runtime.availability import BackendUnavailable
from bunraku.websocket.subprotocol import TRY_AGAIN_LATER, CloseConnection, run_until_first_ends


async def test_other_coroutines_are_cancelled_when_the_first_ends() -> None:
    ended = asyncio.Event()

    async def wait_for_ever() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async def disconnect() -> None:
        await asyncio.sleep(0)
        raise WebSocketDisconnect(1001)

    await run_until_first_ends(wait_for_ever(), disconnect())
    assert ended.is_set()


async def test_exception_of_the_first_coroutine_is_raised() -> None:
    async def wait_for_ever() -> None:
        await asyncio.Event().wait()

    async def close() -> None:
        raise CloseConnection(1008, "Broken", "malformed")

    with pytest.raises(CloseConnection, match="malformed"):
        await run_until_first_ends(close(), wait_for_ever())


def test_unavailable_backend_asks_the_client_to_try_again_later() -> None:
    reason = CloseConnection.unavailable(BackendUnavailable("the bus", "connection refused by 10.0.0.7"))
    assert (reason.code, reason.title) == (TRY_AGAIN_LATER, "Not now")
    assert "the bus" in reason.detail
    assert "10.0.0.7" not in reason.detail
