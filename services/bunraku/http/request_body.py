"""Limits on the size, the duration and the chunks of request bodies, enforced while they are received."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

MIN_BODY_BYTES_PER_S = 500
"""Minimum throughput of a body in each time window, in bytes per second: half of a phone's at 9.6 kbit/s."""
MIN_CHUNK_BYTES = 256
"""Minimum average size of a body's chunks; a body over a link with an MTU of 296 has segments of this size."""
MAX_SMALL_CHUNKS = 64
"""Chunks of a body for which the average does not count."""


def too_large_detail(max_bytes: int) -> str:
    """Return the error detail for a body that is too large."""
    return f"the request body has more than {max_bytes} bytes, the limit of this route"


def limit_body(receive: Receive, max_bytes: int | None, window_s: float, clock: Callable[[], float]) -> Receive:
    """Return `receive` with limits on the request body. `clock` returns seconds.

    It raises HTTPException 413 as soon as the body has more than `max_bytes` bytes. It raises HTTPException 408 when a
    window of `window_s` seconds is over, in which the body neither ended nor brought `MIN_BODY_BYTES_PER_S` on average.
    A window ends early when it has brought as much, so that fast data before a pause buys no time.
    """
    # FastAPI passes on only HTTPException from `receive`, so these errors are no `ProblemError`
    window_end, window_bytes, size, is_complete = clock() + window_s, 0, 0, False

    def check_progress() -> None:
        """Begin the next window if enough arrived in this one; raise HTTPException 408 if it is over without that."""
        nonlocal window_end, window_bytes
        now = clock()
        if window_bytes >= MIN_BODY_BYTES_PER_S * window_s:
            window_end, window_bytes = now + window_s, 0
        elif now >= window_end:
            detail = f"the request body arrived too slowly: {window_bytes} bytes in {window_s:g} s"
            raise HTTPException(408, detail, {"Connection": "close"})

    async def receive_limited() -> Message:
        nonlocal size, window_bytes, is_complete
        while not is_complete:
            try:
                async with asyncio.timeout(max(window_end - clock(), 0.0)):
                    message = await receive()
            except TimeoutError:
                check_progress()
                continue
            if message["type"] != "http.request":
                is_complete = True
                return message
            received = len(message.get("body", b""))
            size, window_bytes = size + received, window_bytes + received
            if max_bytes is not None and size > max_bytes:
                raise HTTPException(413, too_large_detail(max_bytes), {"Connection": "close"})
            is_complete = not message.get("more_body", False)
            if not is_complete:
                check_progress()
            return message
        return await receive()

    return receive_limited


class ChunkLimit:
    """Limit on the number of chunks of one body, each of which costs as much as a large one.

    Chunks are those of the transfer coding, or the segments in which a body without one arrives.
    """

    def __init__(self) -> None:
        self._chunks = self._bytes = 0

    def add_chunk(self, size: int) -> bool:
        """Count a chunk; return False if there are too many for the size of the body so far."""
        self._chunks += 1
        self._bytes += size
        return self._chunks <= MAX_SMALL_CHUNKS + self._bytes / MIN_CHUNK_BYTES
