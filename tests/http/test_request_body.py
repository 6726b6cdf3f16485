from __future__ import annotations

import asyncio

import pytest
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

from bunraku.http.request_body import MIN_BODY_BYTES_PER_S, limit_body


def body_receiver(*chunks: bytes) -> Receive:
    """Return a `receive` for a body in chunks. After the body it never returns."""
    messages = [
        {"type": "http.request", "body": chunk, "more_body": nth + 1 < len(chunks)} for nth, chunk in enumerate(chunks)
    ]

    async def receive() -> Message:
        return messages.pop(0) if messages else await asyncio.Future()

    return receive


async def read_body(receive: Receive) -> bytes:
    body = b""
    while True:
        message = await receive()
        body += bytes(message["body"])
        if not message["more_body"]:
            return body


async def test_body_within_its_limits_is_unchanged() -> None:
    assert (
        await read_body(limit_body(body_receiver(b"a" * 10, b"b" * 10), 20, 1.0, lambda: 0.0)) == b"a" * 10 + b"b" * 10
    )
    assert await read_body(limit_body(body_receiver(b"a" * 100), None, 1.0, lambda: 0.0)) == b"a" * 100


async def test_too_large_body_is_rejected_at_the_exceeding_chunk() -> None:
    with pytest.raises(HTTPException) as refused:
        await read_body(limit_body(body_receiver(b"a" * 10, b"b" * 11, b"c"), 20, 1.0, lambda: 0.0))
    assert (refused.value.status_code, refused.value.headers) == (413, {"Connection": "close"})


async def test_slow_body_is_rejected_after_the_timeout() -> None:
    clock = 0.0

    async def receive_slowly() -> Message:
        nonlocal clock
        clock += 1.0
        # the last chunk never arrives
        return {"type": "http.request", "body": b"x", "more_body": True} if clock < 9 else await asyncio.Future()

    receive = limit_body(receive_slowly, None, 8.0, lambda: clock)
    with pytest.raises(HTTPException) as refused:
        await read_body(receive)
    assert refused.value.status_code == 408
    assert "bytes in" in str(refused.value.detail)


async def test_body_at_the_minimum_rate_has_no_time_limit() -> None:
    clock = 0.0
    chunks = body_receiver(*[b"x" * MIN_BODY_BYTES_PER_S] * 100)

    async def receive_steadily() -> Message:
        nonlocal clock
        clock += 1.0
        return await chunks()

    assert len(await read_body(limit_body(receive_steadily, None, 5.0, lambda: clock))) == 100 * MIN_BODY_BYTES_PER_S


async def test_waiting_after_the_body_is_not_limited() -> None:
    receive = limit_body(body_receiver(b"x"), None, 0.01, lambda: 0.0)
    await read_body(receive)
    waiting = asyncio.ensure_future(receive())
    assert not (await asyncio.wait((waiting,), timeout=0.05))[0]
    waiting.cancel()
