"""Performers for motions: a motion stays as it is, and a new one is made in which others dance beside its own."""

from __future__ import annotations

import json
from collections import Counter
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.backing.missing import no_such_motion
from bunraku.backing.problems import ProblemError, invalid_field
from bunraku.ingest.derived import Derived
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.uploads import WAITING, Uploads
from bunraku.motion.place import Place
from bunraku.wire.limbs import MOST_PERFORMERS

LONGEST_NAME = 200


class Gathering(BaseModel):
    """Whose performers dance beside a motion's own, and where all of them do."""

    model_config = ConfigDict(extra="forbid")
    motions: Annotated[
        list[Annotated[str, Field(max_length=64)]],
        Field(min_length=1, max_length=MOST_PERFORMERS - 1, description="motions; the same one may come again"),
    ]
    places: Annotated[
        list[Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]] | None,
        Field(
            min_length=2,
            max_length=MOST_PERFORMERS,
            description="x and z, metres, and turn about y, radians, of every performer, the motion's own first; "
            "in a row, facing one way, if not said",
        ),
    ] = None


class Performers:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: Backing, uploads: Uploads) -> None:
        self._backing = backing
        self._derived = Derived(backing, uploads)
        self._jobs = uploads.places
        self._seconds = backing.settings.upload_seconds
        self._under_way = 0

    async def add(self, motion: str, asked: Gathering, subject: str = "") -> tuple[Entry, bool]:
        """The motion `motion` with the performers that are asked for, stored by `subject`, and whether it is new;
        raises `ProblemError`."""
        places = None if asked.places is None else [_place(nth, said) for nth, said in enumerate(asked.places)]
        others = [await self._derived.known(other) for other in asked.motions]
        if self._under_way >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} gatherings are under way", hint="try again in a few seconds")

        async def gather(made: str, stored: StoredMotion) -> Made | Refused:
            found = [await self._stored(other) for other in asked.motions]
            return await self._jobs.run("gather", (made, stored, found, places), self._seconds)

        async def described(before: Entry, made: Made) -> dict[str, Any]:
            pieces = [piece for entry in (before, *others) for piece in pieces_of(entry)]
            rates = together([entry.description["rates"] for entry in (before, *others)])
            return {**before.description, **made.described, "name": named(pieces), "pieces": pieces, "rates": rates}

        self._under_way += 1
        try:
            performed = f" performed with {json.dumps([asked.motions, asked.places])}".encode()
            return await self._derived.add(motion, performed, gather, described, subject=subject)
        finally:
            self._under_way -= 1

    async def _stored(self, motion: str) -> StoredMotion:
        stored = await self._backing.library.get(motion)
        if stored is None:
            raise no_such_motion(motion)
        return stored


def pieces_of(entry: Entry) -> list[str]:
    """What the performers of a motion dance, by name."""
    known = entry.description
    return known.get("pieces") or [str(known.get("name") or "A dance")] * int(known.get("performers", 1))


def named(pieces: list[str]) -> str:
    """What a motion in which these are danced side by side is called."""
    times = Counter(pieces)
    name = " + ".join(piece if many == 1 else f"{piece} \u00d7 {many}" for piece, many in times.items())
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}\u2026"


def together(each: list[list[dict[str, float]]]) -> list[dict[str, float]]:
    """What the rates of several dances cost together, kbit/s, and keep of each: as many as one has at most, of one with
    fewer its highest."""
    return [
        {
            "kbps": round(sum(rates[min(rate, len(rates) - 1)]["kbps"] for rates in each), 3),
            **{key: max(rates[min(rate, len(rates) - 1)][key] for rates in each) for key in ("mean", "max")},
        }
        for rate in range(max(map(len, each)))
    ]


def _place(nth: int, said: list[float]) -> Place:
    try:
        return Place.read(said)
    except ValueError as error:
        raise invalid_field(("places", nth), str(error)) from None
