"""Motions made from another, which stays as it is: found again where the same was made before, else made and stored."""

from __future__ import annotations

import hashlib
from collections.abc import Awaitable, Callable
from typing import Any

from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.backing.missing import no_such_motion
from bunraku.backing.problems import ProblemError
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.storing import check_room, store
from bunraku.ingest.uploads import Uploads, motion_id

Job = Callable[[str, StoredMotion], Awaitable[Made | Refused]]
"""Makes the motion of this new id from the stored one."""
Describe = Callable[[Entry, Made], Awaitable[dict[str, Any]]]
"""What the catalogue says of the new motion, from what it says of the other and what was made."""


class Derived:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._backing = backing
        self._uploads = uploads

    async def known(self, motion: str) -> Entry:
        """What the catalogue says of a motion that can be made something of; raises `ProblemError`."""
        entry = await self._backing.catalogue.get(motion)
        if entry is None or await self._backing.library.get(motion) is None:
            raise no_such_motion(motion)
        return entry

    async def add(
        self, motion: str, with_what: bytes, job: Job, describe: Describe, *, subject: str = "", **told: str
    ) -> tuple[Entry, bool]:
        """The motion `motion` with something, and whether it is new; `with_what` says with what exactly: the same gives
        the same motion. `subject` is who stores it. Raises `ProblemError`, with `told` where the job refuses."""
        backing = self._backing
        before = await self.known(motion)
        made_id = motion_id(hashlib.sha256(motion.encode() + with_what).digest())
        known = await backing.catalogue.get(made_id)
        if known is not None and await backing.library.get(made_id) is not None:
            return known, False
        await check_room(backing, subject)
        async with self._uploads.places:
            # it may have been removed while this waited
            stored = await backing.library.get(motion)
            if stored is None:
                raise no_such_motion(motion)
            made = await job(made_id, stored)
        if isinstance(made, Refused):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint, **told)
        if known is not None:
            # stored in a codec that is no longer spoken: made anew
            await backing.catalogue.remove(made_id)
        return await store(backing, made_id, made, await describe(before, made), subject)
