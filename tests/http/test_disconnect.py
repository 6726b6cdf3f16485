from __future__ import annotations

import asyncio
from typing import Any

import pytest
from starlette.requests import ClientDisconnect, Request

from bunraku.http.disconnect import run_until_disconnect


def make_request(disconnected: asyncio.Event) -> Request:
    async def receive() -> dict[str, Any]:
        await disconnected.wait()
        return {"type": "http.disconnect"}

    return Request({"type": "http", "headers": []}, receive)


async def test_result_and_exception_are_passed_on() -> None:
    async def double(number: int) -> int:
        if number < 0:
            raise LookupError(number)
        return 2 * number

    request = make_request(asyncio.Event())
    assert await run_until_disconnect(request, double(4)) == 8
    with pytest.raises(LookupError):
        await run_until_disconnect(request, double(-1))


async def test_disconnect_cancels_the_operation() -> None:
    disconnected, cancelled = asyncio.Event(), asyncio.Event()

    async def work_forever() -> None:
        disconnected.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()

    with pytest.raises(ClientDisconnect):
        await run_until_disconnect(make_request(disconnected), work_forever())
    assert cancelled.is_set()
