"""Sound for motions: a motion stays as it is, and a new one is made that is the same with audio beside it."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

from starlette.requests import Request

from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.ingest import jobs
from bunraku.ingest.derived import Derived
from bunraku.ingest.progress import Progress
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.uploads import Uploads


class Soundtracks:
    """The sounds that come to one replica, as uploads beside its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._uploads = uploads
        self._derived = Derived(backing, uploads)
        self._seconds = backing.settings.upload_seconds

    async def take(self, request: Request, motion: str, filename: str, upload: str | None = None) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the request's body, and whether it is new. `upload` and errors as of
        `Uploads.receive`; a motion that there is not raises `ProblemError` before the body is read."""
        await self._derived.known(motion)

        async def add(digest: bytes, path: Path, progress: Progress) -> tuple[Entry, bool]:
            return await self.add(motion, digest, path, filename, progress)

        return await self._uploads.receive(request, upload, add)

    async def add(
        self, motion: str, digest: bytes, path: Path, filename: str, progress: Progress | None = None
    ) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the file at `path`, whose SHA-256 is `digest`, and whether it is new;
        raises `ProblemError`."""
        under_way = progress or Progress()
        under_way.at("waiting")

        async def sing(made: str, stored: StoredMotion) -> Made | Refused:
            under_way.at("reading")
            return await jobs.run(
                "add", (made, stored, path), self._seconds, lambda share: under_way.at("encoding", share)
            )

        async def described(before: Entry, made: Made) -> dict[str, Any]:
            size = await asyncio.to_thread(os.path.getsize, path)
            audio = {"filename": filename, "bytes": size, **made.described["audio"]}
            return {**before.description, **made.described, "audio": audio}

        return await self._derived.add(motion, b" with the sound " + digest, sing, described, filename=filename)
