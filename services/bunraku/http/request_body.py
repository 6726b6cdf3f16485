"""Limits on the size and the duration of request bodies, enforced while they are received."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

MIN_BODY_BYTES_PER_S = 1_000
"""Minimum rate of a body after the initial timeout, in bytes per second."""


def too_large_detail(max_bytes: int) -> str:
    """Return the error detail for a body that is too large."""
    return f"the request body has more than {max_bytes} bytes, the limit of this route"


def limit_body(receive: Receive, max_bytes: int | None, timeout_s: float, clock: Callable[[], float]) -> Receive:
    """Return `receive` with limits on the request body. `clock` returns seconds.

    It raises HTTPException 413 as soon as the body has more than `max_bytes` bytes. It raises HTTPException 408 if the
    body takes longer than `timeout_s` plus one second per `MIN_BODY_BYTES_PER_S` bytes.
    """
    # FastAPI passes on only HTTPException from `receive`, so these errors are no `ProblemError`
    started_at, size, is_complete = clock(), 0, False

    async def receive_limited() -> Message:
        nonlocal size, is_complete
        if is_complete:
            return await receive()
        remaining_s = started_at + timeout_s + size / MIN_BODY_BYTES_PER_S - clock()
        try:
            async with asyncio.timeout(max(remaining_s, 0.0)):
                message = await receive()
        except TimeoutError:
            detail = f"the request body arrived too slowly: {size} bytes in {clock() - started_at:.0f} s"
            raise HTTPException(408, detail, {"Connection": "close"}) from None
        if message["type"] == "http.request":
            size += len(message.get("body", b""))
            is_complete = not message.get("more_body", False)
            if max_bytes is not None and size > max_bytes:
                raise HTTPException(413, too_large_detail(max_bytes), {"Connection": "close"})
        else:
            is_complete = True
        return message

    return receive_limited
