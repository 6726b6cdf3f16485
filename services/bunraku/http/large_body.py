"""Request bodies that are too large to be kept in memory or parsed on the event loop.

A body of more than a few kilobytes is written to a temporary file, and the function that parses it runs in a worker
process. Hostile bodies thus cost the service neither memory nor time, whatever they contain.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator, Callable, Collection
from pathlib import Path
from typing import Any, TypeVar

from starlette.requests import Request
from starlette.responses import StreamingResponse

from bunraku.http.access_control import DEFAULT_MAX_BODY_BYTES
from bunraku.http.admission import AdmissionLimit, holder_of
from bunraku.runtime.insufficient_storage import translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import temporary_folder
from bunraku.runtime.worker_process import WorkerFailed, WorkerTimedOut, run_in_worker

MAX_LARGE_BODIES = 8
"""Large bodies of one kind that are received, processed or answered at the same time; further ones get 503."""
MAX_LARGE_BODIES_PER_HOLDER = 2
"""Large bodies of one kind and one subject, or one address without a subject."""
PROCESSING_TIMEOUT_S = 30.0
"""Time limit for the processing of one body in its worker process, in seconds."""
WRITE_CHUNK_BYTES = 256 << 10
RESPONSE_PIECE_BYTES = 64 << 10

BodySource = bytes | Path
"""A received body: its bytes if it is small, or the file that holds it."""
Result = TypeVar("Result")


def read_body(source: BodySource) -> bytes:
    """Return the bytes of a received body. Call it for a file only in a worker process."""
    return source if isinstance(source, bytes) else source.read_bytes()


class LargeBodies:
    """Large bodies of one kind of request.

    Use `receive` as a FastAPI dependency: the slot and the file of the body are kept until the response is sent.
    """

    def __init__(
        self, kind: str, *, max_inline_bytes: int = DEFAULT_MAX_BODY_BYTES, records: Collection[type] = ()
    ) -> None:
        """`kind` names them in problems, in the plural. Bodies of at most `max_inline_bytes` are not large.

        `records` are the dataclasses that functions for large bodies return.
        """
        self._max_inline_bytes = max_inline_bytes
        self._records = records
        self._limit = AdmissionLimit(kind, MAX_LARGE_BODIES, MAX_LARGE_BODIES_PER_HOLDER)
        # one at a time: the other processor is for the service
        self._processing = asyncio.Semaphore(1)

    async def receive(self, request: Request) -> AsyncIterator[BodySource]:
        """Yield the body of a request; raise `ProblemError` 503 for one large body too many, 507 for a full disk."""
        start, chunks = bytearray(), request.stream()
        async for chunk in chunks:
            start += chunk
            if len(start) > self._max_inline_bytes:
                break
        else:
            yield bytes(start)
            return
        with (
            self._limit.admit(holder_of(request)),
            translate_disk_full("this server"),
            temporary_folder("body") as folder,
        ):
            path = folder / "body"
            await write_body(_prepend(bytes(start), chunks), path)
            yield path

    async def process(self, function: Callable[..., Result], source: BodySource, *arguments: Any) -> Result:
        """Return the result of a function of a module for a received body: in a worker process for a file.

        Raise `ProblemError` if the function does, 503 if it takes too long, or 422 if the process fails.
        """
        if isinstance(source, bytes):
            return function(source, *arguments)
        async with self._processing:
            try:
                return await run_in_worker(function, (source, *arguments), PROCESSING_TIMEOUT_S, records=self._records)
            except WorkerTimedOut as error:
                # permitted bodies take a second: the machine is busy
                raise ProblemError(503, "Busy", str(error), hint="try again in a few seconds") from None
            except WorkerFailed as error:
                detail = f"the body could not be processed: {error}"
                raise ProblemError(422, "Cannot be processed", detail, hint="send several smaller requests") from None


async def write_body(
    chunks: AsyncIterator[bytes], path: Path, on_received: Callable[[int], None] = lambda _: None
) -> bytes:
    """Write the chunks of a body to a file and return its SHA-256 digest.

    `on_received` receives the number of bytes so far, and may raise to reject the body.
    """
    digest, size, pending = hashlib.sha256(), 0, bytearray()
    with path.open("wb") as file:
        async for chunk in chunks:
            size += len(chunk)
            on_received(size)
            digest.update(chunk)
            pending += chunk
            if len(pending) >= WRITE_CHUNK_BYTES:
                await asyncio.to_thread(file.write, bytes(pending))
                pending.clear()
        await asyncio.to_thread(file.write, bytes(pending))
    return digest.digest()


def large_response(data: bytes, media_type: str) -> StreamingResponse:
    """Return a response that is written in pieces, each when the client has received those before it."""

    async def pieces() -> AsyncIterator[bytes]:
        for begin in range(0, len(data), RESPONSE_PIECE_BYTES):
            yield data[begin : begin + RESPONSE_PIECE_BYTES]

    return StreamingResponse(pieces(), headers={"Content-Length": str(len(data))}, media_type=media_type)


async def _prepend(start: bytes, chunks: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    yield start
    async for chunk in chunks:
        yield chunk
