from __future__ import annotations

import asyncio

import pytest
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

from bunraku.http.request_body import MIN_BODY_BYTES_PER_S, limit_body


def body_receiver(*pieces: bytes) -> Receive:
    """A body in pieces; after it nothing comes for ever."""
    left = [
        {"type": "http.request", "body": piece, "more_body": nth + 1 < len(pieces)} for nth, piece in enumerate(pieces)
    ]

    async def receive() -> Message:
        return left.pop(0) if left else await asyncio.Future()

    return receive


async def read_body(receive: Receive) -> bytes:
    body = b""
    while True:
        message = await receive()
        body += bytes(message["body"])
        if not message["more_body"]:
            return body


async def test_a_body_within_its_bounds_comes_as_it_is() -> None:
    assert (
        await read_body(limit_body(body_receiver(b"a" * 10, b"b" * 10), 20, 1.0, lambda: 0.0)) == b"a" * 10 + b"b" * 10
    )
    assert await read_body(limit_body(body_receiver(b"a" * 100), None, 1.0, lambda: 0.0)) == b"a" * 100


async def test_one_that_is_too_large_is_refused_with_the_piece_that_makes_it_so() -> None:
    with pytest.raises(HTTPException) as refused:
        await read_body(limit_body(body_receiver(b"a" * 10, b"b" * 11, b"c"), 20, 1.0, lambda: 0.0))
    assert (refused.value.status_code, refused.value.headers) == (413, {"Connection": "close"})


async def test_one_that_comes_drop_by_drop_is_refused_when_its_time_is_over() -> None:
    clock = 0.0

    async def drops() -> Message:
        nonlocal clock
        clock += 1.0
        # the last one would never come
        return {"type": "http.request", "body": b"x", "more_body": True} if clock < 9 else await asyncio.Future()

    receive = limit_body(drops, None, 8.0, lambda: clock)
    with pytest.raises(HTTPException) as refused:
        await read_body(receive)
    assert refused.value.status_code == 408
    assert "bytes in" in str(refused.value.detail)


async def test_who_sends_fast_enough_has_all_the_time_that_takes() -> None:
    clock = 0.0
    pieces = body_receiver(*[b"x" * MIN_BODY_BYTES_PER_S] * 100)

    async def steady() -> Message:
        nonlocal clock
        clock += 1.0
        return await pieces()

    assert len(await read_body(limit_body(steady, None, 5.0, lambda: clock))) == 100 * MIN_BODY_BYTES_PER_S


async def test_after_the_body_there_is_no_limit() -> None:
    receive = limit_body(body_receiver(b"x"), None, 0.01, lambda: 0.0)
    await read_body(receive)
    waiting = asyncio.ensure_future(receive())
    assert not (await asyncio.wait((waiting,), timeout=0.05))[0]
    waiting.cancel()
