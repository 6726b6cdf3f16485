"""What is on its way in: bounded in number, size and time, and never half stored."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import os
import secrets
import tempfile
from collections.abc import Callable, Coroutine
from pathlib import Path, PurePath
from typing import Any

from starlette.requests import ClientDisconnect, Request

from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Entry
from bunraku.backing.problems import ProblemError
from bunraku.ingest import jobs
from bunraku.ingest.progress import Progress
from bunraku.ingest.results import Made, Refused

AT_ONCE = 2
"""Jobs that are at work at the same time; the rest wait."""
WAITING = 16
"""Uploads that may be under way; one more is told to come again."""
CHUNK = 1 << 20

Add = Callable[[bytes, Path, Progress], Coroutine[Any, Any, tuple[Entry, bool]]]
"""Makes a motion of a file: of its SHA-256, where it lies, and what is told how far that is. Whether it is new, too."""


def motion_id(digest: bytes) -> str:
    """The id of the file with this SHA-256: the same bytes have the same id. 20 characters, a-z and 2-7."""
    return base64.b32encode(digest).decode().lower()[:20]


class Uploads:
    """The uploads of one replica."""

    def __init__(self, backing: Backing) -> None:
        """`places` bounds the jobs that are at work at the same time; the rest wait."""
        self._backing = backing
        self.places = asyncio.Semaphore(AT_ONCE)
        self._under_way: dict[str, Progress] = {}

    def progress(self, upload: str) -> Progress | None:
        """How far an upload is by the name that its sender gave it, None when it is not, or no longer, under way."""
        return self._under_way.get(upload)

    async def take(self, request: Request, filename: str, upload: str | None = None) -> tuple[Entry, bool]:
        """The motion of the request's body, and whether it is new. `upload` and errors as of `receive`."""

        async def add(digest: bytes, path: Path, progress: Progress) -> tuple[Entry, bool]:
            return await self.add(motion_id(digest), path, filename, progress)

        return await self.receive(request, upload, add)

    async def receive(self, request: Request, upload: str | None, add: Add) -> tuple[Entry, bool]:
        """What `add` makes of the file in the request's body, and whether that is new; while it is under way its
        `progress` can be asked for by the name `upload`.

        Raises `ProblemError`, and `ClientDisconnect` where the sender goes away: all that was begun is then ended.
        """
        if len(self._under_way) >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} uploads are under way", hint="try again in a few seconds")
        if upload in self._under_way:
            raise ProblemError(409, "Name in use", f"another upload is called {upload!r}", field="upload")
        # a name that nobody can ask for, where none was given
        name = upload or f"/{secrets.token_hex()}"
        progress = self._under_way[name] = Progress()
        try:
            with tempfile.TemporaryDirectory(prefix="bunraku-upload-") as folder:
                path = Path(folder) / "source"
                digest = await self._receive(request, path, progress)
                return await _while_there(request, add(digest, path, progress))
        finally:
            del self._under_way[name]

    async def add(self, motion: str, path: Path, filename: str, progress: Progress | None = None) -> tuple[Entry, bool]:
        """The motion of the file at `path`, whose id is `motion`, and whether it is new; raises `ProblemError`."""
        progress = progress or Progress()
        progress.at("waiting")
        known = await self._backing.catalogue.get(motion)
        if known is not None and await self._backing.library.get(motion) is not None:
            return known, False
        async with self.places:
            progress.at("reading")
            seconds = self._backing.settings.upload_seconds
            made = await jobs.run("make", (motion, path), seconds, lambda share: progress.at("encoding", share))
        size = await asyncio.to_thread(os.path.getsize, path)
        if known is not None and isinstance(made, Made):
            # stored in a codec that is no longer spoken: made anew
            await self._backing.catalogue.remove(motion)
        return await self._store(motion, made, filename, size)

    async def _receive(self, request: Request, path: Path, progress: Progress) -> bytes:
        """Write the body to `path`; its SHA-256."""
        limit = self._backing.settings.upload_bytes
        too_large = ProblemError(
            413, "Too large", f"a file may have {limit} bytes", limit=limit, hint="cut it into shorter clips"
        )
        announced = int(request.headers.get("content-length") or 0)
        if announced > limit:
            raise too_large
        digest, size, pending = hashlib.sha256(), 0, bytearray()
        with path.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    raise too_large
                progress.at("receiving", size / announced if announced else 0.0)
                digest.update(chunk)
                pending += chunk
                if len(pending) >= CHUNK:
                    await asyncio.to_thread(file.write, bytes(pending))
                    pending.clear()
            file.write(pending)
        return digest.digest()

    async def _store(self, motion: str, made: Made | Refused, filename: str, size: int) -> tuple[Entry, bool]:
        if isinstance(made, Refused):
            raise ProblemError(
                422, made.title, made.detail, line=made.line, field=made.field, hint=made.hint, filename=filename
            )
        # the object first: a row always has its object, and an object without a row is harmless
        await self._backing.library.put(motion, made.packed)
        described = {"name": PurePath(filename).stem or filename, "filename": filename, "bytes": size, **made.described}
        entry = Entry(motion, clock(), described)
        new = await self._backing.catalogue.add(entry)
        return (entry if new else (await self._backing.catalogue.get(motion) or entry)), new


async def _while_there(request: Request, making: Coroutine[Any, Any, tuple[Entry, bool]]) -> tuple[Entry, bool]:
    """The result of `making`, broken off when the sender of the request goes away."""
    adding = asyncio.create_task(making)
    leaving = asyncio.create_task(_gone(request))
    try:
        await asyncio.wait((adding, leaving), return_when=asyncio.FIRST_COMPLETED)
        if not adding.done():
            raise ClientDisconnect
        return adding.result()
    finally:
        adding.cancel()
        leaving.cancel()
        await asyncio.wait((adding, leaving))


async def _gone(request: Request) -> None:
    """Wait until the sender of a request whose body is read has gone away."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
