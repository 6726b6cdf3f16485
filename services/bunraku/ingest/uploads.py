"""What is on its way in: bounded in number, size and time, and never half stored."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import os
import tempfile
from pathlib import Path, PurePath

from starlette.requests import Request

from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Entry
from bunraku.backing.problems import ProblemError
from bunraku.ingest import jobs
from bunraku.ingest.results import Made, Refused

AT_ONCE = 2
"""Uploads that are encoded at the same time; the rest wait."""
WAITING = 16
"""Uploads that may be under way; one more is told to come again."""
CHUNK = 1 << 20


def motion_id(digest: bytes) -> str:
    """The id of the file with this SHA-256: the same bytes have the same id. 20 characters, a-z and 2-7."""
    return base64.b32encode(digest).decode().lower()[:20]


class Uploads:
    """The uploads of one replica."""

    def __init__(self, backing: Backing) -> None:
        self._backing = backing
        self._places = asyncio.Semaphore(AT_ONCE)
        self._under_way = 0

    async def take(self, request: Request, filename: str) -> tuple[Entry, bool]:
        """The motion of the request's body, and whether it is new; raises `ProblemError`."""
        if self._under_way >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} uploads are under way", hint="try again in a few seconds")
        self._under_way += 1
        try:
            with tempfile.TemporaryDirectory(prefix="bunraku-upload-") as folder:
                path = Path(folder) / "source"
                motion = await self._receive(request, path)
                return await self.add(motion, path, filename)
        finally:
            self._under_way -= 1

    async def add(self, motion: str, path: Path, filename: str) -> tuple[Entry, bool]:
        """The motion of the file at `path`, whose id is `motion`, and whether it is new; raises `ProblemError`."""
        known = await self._backing.catalogue.get(motion)
        if known is not None and await self._backing.library.get(motion) is not None:
            return known, False
        async with self._places:
            made = await jobs.run(motion, path, self._backing.settings.upload_seconds)
        size = await asyncio.to_thread(os.path.getsize, path)
        if known is not None and isinstance(made, Made):
            # stored in a codec that is no longer spoken: made anew
            await self._backing.catalogue.remove(motion)
        return await self._store(motion, made, filename, size)

    async def _receive(self, request: Request, path: Path) -> str:
        limit = self._backing.settings.upload_bytes
        too_large = ProblemError(
            413, "Too large", f"a file may have {limit} bytes", limit=limit, hint="cut it into shorter clips"
        )
        if int(request.headers.get("content-length") or 0) > limit:
            raise too_large
        digest, size, pending = hashlib.sha256(), 0, bytearray()
        with path.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    raise too_large
                digest.update(chunk)
                pending += chunk
                if len(pending) >= CHUNK:
                    await asyncio.to_thread(file.write, bytes(pending))
                    pending.clear()
            file.write(pending)
        return motion_id(digest.digest())

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
