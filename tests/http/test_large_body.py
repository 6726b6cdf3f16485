from __future__ import annotations

import asyncio
import os
import tempfile
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from fastapi import Depends, FastAPI
from starlette.requests import ClientDisconnect, Request
from starlette.responses import StreamingResponse

from bunraku.http.access_control import ACCESS_SCOPE_KEY, Access, Role
from bunraku.http.large_body import (
    MAX_LARGE_BODIES,
    MAX_LARGE_BODIES_PER_HOLDER,
    RESPONSE_PIECE_BYTES,
    BodySource,
    LargeBodies,
    large_response,
    read_body,
)
from bunraku.runtime.problem import ProblemError

INLINE_BYTES = 100


def make_request(*chunks: bytes, subject: str = "aiko", is_complete: bool = True) -> Request:
    """Return a request whose client disconnects after the chunks."""
    messages: list[dict[str, Any]] = [{"type": "http.request", "body": chunk, "more_body": True} for chunk in chunks]
    if is_complete:
        messages.append({"type": "http.request", "body": b"", "more_body": False})

    async def receive() -> dict[str, Any]:
        return messages.pop(0) if messages else {"type": "http.disconnect"}

    return Request({"type": "http", "headers": [], ACCESS_SCOPE_KEY: Access(Role.VIEW, subject)}, receive)


@asynccontextmanager
async def receive(bodies: LargeBodies, request: Request) -> AsyncIterator[BodySource]:
    async with asynccontextmanager(bodies.receive)(request) as body:
        yield body


def describe_body(source: BodySource, parent: int) -> list[int | bool]:
    # a worker process passes on plain values: no tuple
    return [len(read_body(source)), os.getpid() == parent]


def reject_body(source: BodySource) -> None:
    raise ProblemError(422, "Invalid request", f"{len(read_body(source))} bytes")


def crash(_: BodySource) -> None:
    os.abort()


def body_folders() -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob("bunraku-body-*"))


async def test_small_body_is_processed_in_this_process() -> None:
    bodies = LargeBodies("batches", max_inline_bytes=INLINE_BYTES)
    async with receive(bodies, make_request(b"x" * 60, b"y" * 40)) as body:
        assert body == b"x" * 60 + b"y" * 40
        assert await bodies.process(describe_body, body, os.getpid()) == [100, True]
    async with receive(bodies, make_request()) as body:
        assert body == b""


async def test_large_body_is_a_file_that_another_process_reads() -> None:
    bodies = LargeBodies("batches", max_inline_bytes=INLINE_BYTES)
    async with receive(bodies, make_request(b"x" * 60, b"y" * 41, b"z" * 1_000_000)) as body:
        assert isinstance(body, Path)
        assert await asyncio.to_thread(body.read_bytes) == b"x" * 60 + b"y" * 41 + b"z" * 1_000_000
        assert await bodies.process(describe_body, body, os.getpid()) == [1_000_101, False]
        with pytest.raises(ProblemError, match="1000101 bytes"):
            await bodies.process(reject_body, body)
        with pytest.raises(ProblemError) as raised:
            await bodies.process(crash, body)
        assert raised.value.status == 422
    assert body_folders() == []


async def test_large_bodies_are_limited_in_total_and_per_holder() -> None:
    bodies = LargeBodies("batches", max_inline_bytes=INLINE_BYTES)
    large = b"x" * (INLINE_BYTES + 1)
    async with AsyncExitStack() as stack:
        for number in range(MAX_LARGE_BODIES):
            subject = f"subject {number // MAX_LARGE_BODIES_PER_HOLDER}"
            await stack.enter_async_context(receive(bodies, make_request(large, subject=subject)))
            if number == MAX_LARGE_BODIES_PER_HOLDER - 1:
                with pytest.raises(ProblemError, match="you have") as raised:
                    await stack.enter_async_context(receive(bodies, make_request(large, subject=subject)))
                assert raised.value.status == 503
        with pytest.raises(ProblemError, match=f"{MAX_LARGE_BODIES} batches"):
            await stack.enter_async_context(receive(bodies, make_request(large, subject="another")))
        # small ones need no slot
        await stack.enter_async_context(receive(bodies, make_request(b"x", subject="another")))
    async with receive(bodies, make_request(large)):
        pass
    assert body_folders() == []


async def test_disconnect_within_a_body_leaves_nothing() -> None:
    bodies = LargeBodies("batches", max_inline_bytes=INLINE_BYTES)
    for _ in range(MAX_LARGE_BODIES + 1):
        with pytest.raises(ClientDisconnect):
            async with receive(bodies, make_request(b"x" * 1_000, is_complete=False)):
                pytest.fail("received")
    assert body_folders() == []


async def test_large_response_is_sent_in_pieces() -> None:
    data = bytes(range(256)) * 1_000
    response = large_response(data, "application/json")
    assert response.headers["content-length"] == str(len(data))
    pieces = [bytes(piece) async for piece in response.body_iterator]  # type: ignore[arg-type]
    assert b"".join(pieces) == data
    assert max(map(len, pieces)) == RESPONSE_PIECE_BYTES


async def test_slot_and_file_are_kept_until_the_response_is_sent() -> None:
    bodies, app = LargeBodies("batches", max_inline_bytes=INLINE_BYTES), FastAPI()

    @app.post("/echo")
    async def echo(body: BodySource = Depends(bodies.receive)) -> StreamingResponse:
        return large_response(await asyncio.to_thread(read_body, body), "text/plain")

    data, sent, may_continue = b"x" * 2 * RESPONSE_PIECE_BYTES, list[bytes](), asyncio.Event()
    first_piece = asyncio.Event()

    async def send(message: Any) -> None:
        if body := message.get("body"):
            sent.append(body)
            first_piece.set()
            await may_continue.wait()

    request = make_request(data)

    async def receive_and_stay() -> Any:
        message = await request.receive()
        return message if message["type"] == "http.request" else await asyncio.Future()

    scope = {**request.scope, "method": "POST", "path": "/echo", "raw_path": b"/echo", "query_string": b""}
    responding = asyncio.create_task(app(scope, receive_and_stay, send))
    await first_piece.wait()
    assert len(body_folders()) == 1
    may_continue.set()
    await responding
    assert b"".join(sent) == data
    assert body_folders() == []
