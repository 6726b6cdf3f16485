"""Sound for motions: a motion stays as it is, and a new one is made that is the same with audio beside it."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

from starlette.requests import Request

from bunraku.backing.access import access_of
from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.ingest.derived import Derived
from bunraku.ingest.progress import Progress
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.uploads import Uploads, motion_id


class Soundtracks:
    """The sounds that come to one replica, as uploads beside its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._uploads = uploads
        self._derived = Derived(backing, uploads)
        self._places = uploads.places
        self._seconds = backing.settings.upload_seconds
        uploads.queue.kinds["audio"] = self._make

    async def take(self, request: Request, motion: str, filename: str, upload: str | None = None) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the request's body, and whether it is new. `upload` and errors as of
        `Uploads.receive`; a motion that there is not raises `ProblemError` before the body is read."""
        await self._derived.known(motion)
        subject = access_of(request).subject

        async def add(digest: bytes, path: Path, progress: Progress) -> tuple[Entry, bool]:
            return await self.add(motion, digest, path, filename, progress, subject=subject)

        def details(digest: bytes) -> tuple[str, dict[str, Any]]:
            said = {"kind": "audio", "motion": motion, "digest": digest.hex(), "filename": filename, "subject": subject}
            return f"{motion}-{motion_id(digest)}", said

        return await self._uploads.receive(request, upload, details, add)

    async def _make(self, details: dict[str, Any], path: Path) -> None:
        """As `queue.Make`."""
        digest, subject = bytes.fromhex(details["digest"]), details.get("subject", "")
        await self.add(details["motion"], digest, path, details["filename"], subject=subject)

    async def add(
        self,
        motion: str,
        digest: bytes,
        path: Path,
        filename: str,
        progress: Progress | None = None,
        *,
        subject: str = "",
    ) -> tuple[Entry, bool]:
        """The motion `motion` with the sound of the file at `path`, whose SHA-256 is `digest`, stored by `subject`, and
        whether it is new; raises `ProblemError`."""
        under_way = progress or Progress()
        under_way.at("waiting")

        async def sing(made: str, stored: StoredMotion) -> Made | Refused:
            under_way.at("reading")
            return await self._places.run(
                "add", (made, stored, path), self._seconds, lambda share: under_way.at("encoding", share)
            )

        async def described(before: Entry, made: Made) -> dict[str, Any]:
            size = await asyncio.to_thread(os.path.getsize, path)
            audio = {"filename": filename, "bytes": size, **made.described["audio"]}
            return {**before.description, **made.described, "audio": audio}

        with_what = b" with the sound " + digest
        return await self._derived.add(motion, with_what, sing, described, subject=subject, filename=filename)
