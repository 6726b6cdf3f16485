"""Sound for motions: a motion stays as it is, and a new one is made that is the same with audio beside it."""

from __future__ import annotations

import asyncio
import hashlib
import os
from pathlib import Path

from starlette.requests import Request

from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Entry
from bunraku.backing.problems import ProblemError
from bunraku.ingest import jobs
from bunraku.ingest.entry import no_such_motion
from bunraku.ingest.progress import Progress
from bunraku.ingest.results import Refused
from bunraku.ingest.uploads import Uploads, motion_id


class Soundtracks:
    """The sounds that come to one replica, as uploads beside its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._backing = backing
        self._uploads = uploads

    async def take(self, request: Request, motion: str, filename: str, upload: str | None = None) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the request's body, and whether it is new. `upload` and errors as of
        `Uploads.receive`; a motion that there is not raises `ProblemError` before the body is read."""
        await self._known(motion)

        async def add(digest: bytes, path: Path, progress: Progress) -> tuple[Entry, bool]:
            return await self.add(motion, digest, path, filename, progress)

        return await self._uploads.receive(request, upload, add)

    async def add(
        self, motion: str, digest: bytes, path: Path, filename: str, progress: Progress | None = None
    ) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the file at `path`, whose SHA-256 is `digest`, and whether it is new;
        raises `ProblemError`."""
        progress = progress or Progress()
        progress.at("waiting")
        backing = self._backing
        before = await self._known(motion)
        made_id = motion_id(hashlib.sha256(f"{motion} with the sound ".encode() + digest).digest())
        known = await backing.catalogue.get(made_id)
        if known is not None and await backing.library.get(made_id) is not None:
            return known, False
        async with self._uploads.places:
            # it may have been removed while this waited
            stored = await backing.library.get(motion)
            if stored is None:
                raise no_such_motion(motion)
            progress.at("reading")
            seconds = backing.settings.upload_seconds
            arguments = (made_id, stored, path)
            made = await jobs.run("add", arguments, seconds, lambda share: progress.at("encoding", share))
        if isinstance(made, Refused):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint, filename=filename)
        if known is not None:
            # stored in a codec that is no longer spoken: made anew
            await backing.catalogue.remove(made_id)
        size = await asyncio.to_thread(os.path.getsize, path)
        audio = {"filename": filename, "bytes": size, **made.described["audio"]}
        described = {**before.description, **made.described, "audio": audio}
        # the object first: a row always has its object, and an object without a row is harmless
        await backing.library.put(made_id, made.packed)
        entry = Entry(made_id, clock(), described)
        new = await backing.catalogue.add(entry)
        return (entry if new else (await backing.catalogue.get(made_id) or entry)), new

    async def _known(self, motion: str) -> Entry:
        entry = await self._backing.catalogue.get(motion)
        if entry is None or await self._backing.library.get(motion) is None:
            raise no_such_motion(motion)
        return entry
