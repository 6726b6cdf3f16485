"""Cameras and lights for motions: a motion stays as it is, and a new one is made that is the same with them beside."""

from __future__ import annotations

from typing import Any

from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.backing.problems import ProblemError
from bunraku.ingest.derived import Derived
from bunraku.ingest.keyframes import OutOfOrder, Staging, check
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.uploads import WAITING, Uploads


class Stagings:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._derived = Derived(backing, uploads)
        self._places = uploads.places
        self._seconds = backing.settings.upload_seconds
        self._under_way = 0

    async def add(self, motion: str, asked: Staging, subject: str = "") -> tuple[Entry, bool]:
        """The motion `motion` with what is asked for, stored by `subject`, and whether it is new; raises
        `ProblemError`."""
        if asked.camera is None and asked.lights is None:
            raise ProblemError(422, "Nothing to add", "neither a camera nor lights are in it", field="camera")
        try:
            check(asked)
        except OutOfOrder as error:
            raise ProblemError(422, "Out of order", str(error), field=error.field) from None
        if self._under_way >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} stagings are under way", hint="try again in a few seconds")

        async def dress(made: str, stored: StoredMotion) -> Made | Refused:
            return await self._places.run("dress", (made, stored, asked), self._seconds)

        async def described(before: Entry, made: Made) -> dict[str, Any]:
            return {**before.description, **made.described}

        self._under_way += 1
        try:
            staged = f" staged {asked.model_dump_json()}".encode()
            return await self._derived.add(motion, staged, dress, described, subject=subject)
        finally:
            self._under_way -= 1
