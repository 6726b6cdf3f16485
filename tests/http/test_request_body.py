from __future__ import annotations

import asyncio

import pytest
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

from bunraku.http.request_body import MAX_SMALL_CHUNKS, MIN_BODY_BYTES_PER_S, MIN_CHUNK_BYTES, ChunkLimit, limit_body


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


@pytest.mark.parametrize("sent_bytes", [0, 400_000, 60_000_000])
async def test_body_that_stops_is_rejected_after_one_window(sent_bytes: int) -> None:
    """Fast data before the stop buys no time after it."""
    window_s = 0.02
    clock, has_stopped = 0.0, sent_bytes == 0

    async def receive_and_stop() -> Message:
        nonlocal clock, has_stopped
        if not has_stopped:
            has_stopped = True
            return {"type": "http.request", "body": bytes(sent_bytes), "more_body": True}
        try:
            return await asyncio.Future()
        finally:
            # nothing arrived in the rest of the window
            clock += window_s

    with pytest.raises(HTTPException) as refused:
        await read_body(limit_body(receive_and_stop, None, window_s, lambda: clock))
    assert refused.value.status_code == 408
    assert clock == window_s


async def test_phone_at_9600_bits_per_second_may_pause() -> None:
    clock, seconds = 0.0, 0

    async def receive_slowly() -> Message:
        nonlocal clock, seconds
        seconds += 1
        # a pause of ten seconds in each half minute
        clock += 11.0 if seconds % 20 == 0 else 1.0
        return {"type": "http.request", "body": b"x" * 960, "more_body": seconds < 600}

    assert len(await read_body(limit_body(receive_slowly, None, 30.0, lambda: clock))) == 600 * 960


async def test_small_body_may_take_one_window() -> None:
    clock = 0.0

    async def receive_slowly() -> Message:
        nonlocal clock
        clock += 2.9
        return {"type": "http.request", "body": b"x", "more_body": clock < 28}

    assert len(await read_body(limit_body(receive_slowly, None, 30.0, lambda: clock))) == 10


async def test_buffered_data_counts_after_a_delay_of_the_reader() -> None:
    """A body is not rejected because the server itself did not read for a while."""
    clock = 0.0
    receive = limit_body(body_receiver(b"x" * 20_000, b"y"), None, 30.0, lambda: clock)
    clock = 100.0
    assert len(await read_body(receive)) == 20_001


async def test_disconnect_is_passed_on() -> None:
    async def receive_disconnect() -> Message:
        return {"type": "http.disconnect"}

    assert (await limit_body(receive_disconnect, None, 1.0, lambda: 0.0)())["type"] == "http.disconnect"


def test_chunks_may_be_as_small_as_the_segments_of_a_slow_link() -> None:
    limit = ChunkLimit()
    assert all(limit.add_chunk(MIN_CHUNK_BYTES) for _ in range(100_000))


@pytest.mark.parametrize("size", [0, 1, MIN_CHUNK_BYTES // 2])
def test_many_small_chunks_are_too_many(size: int) -> None:
    limit = ChunkLimit()
    accepted = next(number for number in range(10_000) if not limit.add_chunk(size))
    assert MAX_SMALL_CHUNKS <= accepted <= 2 * MAX_SMALL_CHUNKS + 2


async def test_waiting_after_the_body_is_not_limited() -> None:
    receive = limit_body(body_receiver(b"x"), None, 0.01, lambda: 0.0)
    await read_body(receive)
    waiting = asyncio.ensure_future(receive())
    assert not (await asyncio.wait((waiting,), timeout=0.05))[0]
    waiting.cancel()
