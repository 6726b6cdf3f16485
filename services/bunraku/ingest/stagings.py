"""Cameras and lights for motions: a motion stays as it is, and a new one is made that is the same with them beside."""

from __future__ import annotations

import hashlib

from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Entry
from bunraku.backing.problems import ProblemError
from bunraku.ingest import jobs
from bunraku.ingest.entry import no_such_motion
from bunraku.ingest.keyframes import OutOfOrder, Staging, check
from bunraku.ingest.results import Refused
from bunraku.ingest.uploads import WAITING, Uploads, motion_id


class Stagings:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._backing = backing
        self._uploads = uploads
        self._under_way = 0

    async def add(self, motion: str, asked: Staging) -> tuple[Entry, bool]:
        """The motion `motion` with what is asked for, and whether it is new; raises `ProblemError`."""
        if asked.camera is None and asked.lights is None:
            raise ProblemError(422, "Nothing to add", "neither a camera nor lights are in it", field="camera")
        try:
            check(asked)
        except OutOfOrder as error:
            raise ProblemError(422, "Out of order", str(error), field=error.field) from None
        if self._under_way >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} stagings are under way", hint="try again in a few seconds")
        self._under_way += 1
        try:
            return await self._add(motion, asked)
        finally:
            self._under_way -= 1

    async def _add(self, motion: str, asked: Staging) -> tuple[Entry, bool]:
        backing = self._backing
        before = await backing.catalogue.get(motion)
        if before is None:
            raise no_such_motion(motion)
        said = f"{motion} staged {asked.model_dump_json()}"
        made_id = motion_id(hashlib.sha256(said.encode()).digest())
        known = await backing.catalogue.get(made_id)
        if known is not None and await backing.library.get(made_id) is not None:
            return known, False
        async with self._uploads.places:
            # it may have been removed while this waited
            stored = await backing.library.get(motion)
            if stored is None:
                raise no_such_motion(motion)
            made = await jobs.run("dress", (made_id, stored, asked), backing.settings.upload_seconds)
        if isinstance(made, Refused):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint)
        if known is not None:
            # stored in a codec that is no longer spoken: made anew
            await backing.catalogue.remove(made_id)
        # the object first: a row always has its object, and an object without a row is harmless
        await backing.library.put(made_id, made.packed)
        entry = Entry(made_id, clock(), {**before.description, **made.described})
        new = await backing.catalogue.add(entry)
        return (entry if new else (await backing.catalogue.get(made_id) or entry)), new
