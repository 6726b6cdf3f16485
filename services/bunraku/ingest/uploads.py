"""What is on its way in: bounded in number, size and time, never half stored, and not forgotten once it is here."""

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

from bunraku.backing.access import access_of
from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.full import room
from bunraku.backing.problems import ProblemError
from bunraku.ingest.places import Places
from bunraku.ingest.progress import Progress
from bunraku.ingest.queue import Queue
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.storing import check_room, store

AT_ONCE = 2
"""Jobs that are at work at the same time; the rest wait."""
WAITING = 16
"""Uploads that may be under way; one more is told to come again."""
CHUNK = 1 << 20

Add = Callable[[bytes, Path, Progress], Coroutine[Any, Any, tuple[Entry, bool]]]
"""Makes a motion of a file: of its SHA-256, where it lies, and what is told how far that is. Whether it is new, too."""
Details = Callable[[bytes], tuple[str, dict[str, Any]]]
"""Of a file's SHA-256, the id of the job that makes it a motion, and what it needs to know beside the file."""


def motion_id(digest: bytes) -> str:
    """The id of the file with this SHA-256: the same bytes have the same id. 20 characters, a-z and 2-7."""
    return base64.b32encode(digest).decode().lower()[:20]


class Uploads:
    """The uploads of one replica."""

    def __init__(self, backing: Backing) -> None:
        """Upon `backing`; `places` are of the jobs that are at work at the same time."""
        self._backing = backing
        self.places = Places(AT_ONCE)
        self.queue = Queue(backing, self.places)
        self.queue.kinds["motion"] = self._make
        self._under_way: dict[str, Progress] = {}

    @property
    def under_way(self) -> int:
        """How many there are now."""
        return len(self._under_way)

    def progress(self, upload: str) -> Progress | None:
        """How far an upload is by the name that its sender gave it, None when it is not, or no longer, under way."""
        return self._under_way.get(upload)

    async def take(self, request: Request, filename: str, upload: str | None = None) -> tuple[Entry, bool]:
        """The motion of the request's body, and whether it is new. `upload` and errors as of `receive`."""
        subject = access_of(request).subject

        async def add(digest: bytes, path: Path, progress: Progress) -> tuple[Entry, bool]:
            return await self.add(motion_id(digest), path, filename, progress, subject=subject)

        def details(digest: bytes) -> tuple[str, dict[str, Any]]:
            motion = motion_id(digest)
            return motion, {"kind": "motion", "motion": motion, "filename": filename, "subject": subject}

        return await self.receive(request, upload, details, add)

    async def _make(self, details: dict[str, Any], path: Path) -> None:
        """As `queue.Make`."""
        await self.add(details["motion"], path, details["filename"], subject=details.get("subject", ""))

    async def receive(self, request: Request, upload: str | None, details: Details, add: Add) -> tuple[Entry, bool]:
        """What `add` makes of the file in the request's body, and whether that is new; while it is under way its
        `progress` can be asked for by the name `upload`. `details` say how another replica would make it, should this
        one end meanwhile.

        Raises `ProblemError`, and `ClientDisconnect` where the sender goes away: all that was begun is then ended.
        """
        await check_room(self._backing, access_of(request).subject)
        if len(self._under_way) >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} uploads are under way", hint="try again in a few seconds")
        if upload in self._under_way:
            raise ProblemError(409, "Name in use", f"another upload is called {upload!r}", field="upload")
        # a name that nobody can ask for, where none was given
        name = upload or f"/{secrets.token_hex()}"
        progress = self._under_way[name] = Progress()
        try:
            with room("this server"), tempfile.TemporaryDirectory(prefix="bunraku-upload-") as folder:
                path = Path(folder) / "source"
                digest = await self._receive(request, path, progress)
                job, said = details(digest)

                async def noted() -> tuple[Entry, bool]:
                    async with self.queue.noted(job, said, path):
                        return await add(digest, path, progress)

                try:
                    return await _while_there(request, noted())
                except ClientDisconnect:
                    await self.queue.forget(job)
                    raise
        finally:
            del self._under_way[name]

    async def add(
        self, motion: str, path: Path, filename: str, progress: Progress | None = None, *, subject: str = ""
    ) -> tuple[Entry, bool]:
        """The motion of the file at `path`, whose id is `motion`, stored by `subject`, and whether it is new; raises
        `ProblemError`."""
        progress = progress or Progress()
        progress.at("waiting")
        known = await self._backing.catalogue.get(motion)
        if known is not None and await self._backing.library.get(motion) is not None:
            return known, False
        async with self.places:
            progress.at("reading")
            seconds = self._backing.settings.upload_seconds
            made = await self.places.run("make", (motion, path), seconds, lambda share: progress.at("encoding", share))
        size = await asyncio.to_thread(os.path.getsize, path)
        if known is not None and isinstance(made, Made):
            # stored in a codec that is no longer spoken: made anew
            await self._backing.catalogue.remove(motion)
        return await self._store(motion, made, filename, size, subject)

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

    async def _store(
        self, motion: str, made: Made | Refused, filename: str, size: int, subject: str
    ) -> tuple[Entry, bool]:
        if isinstance(made, Refused):
            raise ProblemError(
                422, made.title, made.detail, line=made.line, field=made.field, hint=made.hint, filename=filename
            )
        described = {"name": PurePath(filename).stem or filename, "filename": filename, "bytes": size, **made.described}
        return await store(self._backing, motion, made, described, subject)


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
