"""Bodies of requests, bounded in bytes and in time: what is too large or too slow is refused while it comes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

MIN_BODY_BYTES_PER_S = 1_000
"""Bytes a second that a body comes with at least, once it has had its time to begin."""


def content_too_large(max_bytes: int) -> HTTPException:
    """The answer to a body of more bytes than it may have."""
    return HTTPException(413, f"a body may have {max_bytes} bytes here", {"Connection": "close"})


def limit_body(receive: Receive, max_bytes: int | None, timeout_s: float, clock: Callable[[], float]) -> Receive:
    """`receive`, which raises HTTPException 413 as soon as a body has more than `most` bytes, and 408 where it takes
    more than `patience` seconds and one for each `SLOWEST` bytes. `now` is a clock in seconds."""
    begun, size, whole = clock(), 0, False

    async def receiving() -> Message:
        nonlocal size, whole
        if whole:
            return await receive()
        left = begun + timeout_s + size / MIN_BODY_BYTES_PER_S - clock()
        try:
            async with asyncio.timeout(max(left, 0.0)):
                message = await receive()
        except TimeoutError:
            detail = f"the body came too slowly: {size} bytes in {clock() - begun:.0f} s"
            raise HTTPException(408, detail, {"Connection": "close"}) from None
        if message["type"] == "http.request":
            size += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            if max_bytes is not None and size > max_bytes:
                raise content_too_large(max_bytes)
        else:
            whole = True
        return message

    return receiving
