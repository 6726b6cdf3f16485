"""Performers for motions: a motion stays as it is, and a new one is made in which others dance beside its own."""

from __future__ import annotations

import json
from collections import Counter
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import ProblemError, invalid_field_problem, motion_not_found
from bunraku.ingest.derived_motion import DerivedMotionFactory
from bunraku.ingest.motion import MAX_ACTIVE_UPLOADS, UploadOperation
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.placement import Placement
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry
from bunraku.wire.limbs import MAX_PERFORMERS

MAX_NAME_LENGTH = 200


class PerformersRequest(BaseModel):
    """Whose performers dance beside a motion's own, and where all of them do."""

    model_config = ConfigDict(extra="forbid")
    motions: Annotated[
        list[Annotated[str, Field(max_length=64)]],
        Field(min_length=1, max_length=MAX_PERFORMERS - 1, description="motions; the same one may come again"),
    ]
    places: Annotated[
        list[Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]] | None,
        Field(
            min_length=2,
            max_length=MAX_PERFORMERS,
            description="x and z, metres, and turn about y, radians, of every performer, the motion's own first; "
            "in a row, facing one way, if not said",
        ),
    ] = None


class PerformersOperation:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: ServiceContext, uploads: UploadOperation) -> None:
        self._backing = backing
        self._derived_motions = DerivedMotionFactory(backing, uploads)
        self._worker_slots = uploads.worker_slots
        self._timeout_s = backing.settings.upload_seconds
        self._active = 0

    async def add_performers(
        self, motion: str, request: PerformersRequest, subject: str = ""
    ) -> tuple[CatalogueEntry, bool]:
        """The motion `motion` with the performers that are asked for, stored by `subject`, and whether it is new;
        raises `ProblemError`."""
        places = (
            None if request.places is None else [_parse_placement(nth, said) for nth, said in enumerate(request.places)]
        )
        others = [await self._derived_motions.require_motion(other) for other in request.motions]
        if self._active >= MAX_ACTIVE_UPLOADS:
            raise ProblemError(
                503, "Busy", f"{MAX_ACTIVE_UPLOADS} gatherings are under way", hint="try again in a few seconds"
            )

        async def gather(made: str, stored: StoredMotion) -> JobResult | JobRejection:
            found = [await self._require_stored(other) for other in request.motions]
            return await self._worker_slots.run_job("gather", (made, stored, found, places), self._timeout_s)

        async def described(before: CatalogueEntry, made: JobResult) -> dict[str, Any]:
            pieces = [piece for entry in (before, *others) for piece in performer_motion_names(entry)]
            rates = combined_ladder([entry.description["rates"] for entry in (before, *others)])
            return {
                **before.description,
                **made.description,
                "name": combined_name(pieces),
                "pieces": pieces,
                "rates": rates,
            }

        self._active += 1
        try:
            performed = f" performed with {json.dumps([request.motions, request.places])}".encode()
            return await self._derived_motions.find_or_create(motion, performed, gather, described, subject=subject)
        finally:
            self._active -= 1

    async def _require_stored(self, motion: str) -> StoredMotion:
        stored = await self._backing.motion_store.get(motion)
        if stored is None:
            raise motion_not_found(motion)
        return stored


def performer_motion_names(entry: CatalogueEntry) -> list[str]:
    """What the performers of a motion dance, by name."""
    known = entry.description
    return known.get("pieces") or [str(known.get("name") or "A dance")] * int(known.get("performers", 1))


def combined_name(motion_names: list[str]) -> str:
    """What a motion in which these are danced side by side is called."""
    times = Counter(motion_names)
    name = " + ".join(piece if many == 1 else f"{piece} \u00d7 {many}" for piece, many in times.items())
    return name if len(name) <= MAX_NAME_LENGTH else f"{name[: MAX_NAME_LENGTH - 1]}\u2026"


def combined_ladder(ladders: list[list[dict[str, float]]]) -> list[dict[str, float]]:
    """What the rates of several dances cost together, kbit/s, and keep of each: as many as one has at most, of one with
    fewer its highest."""
    return [
        {
            "kbps": round(sum(rates[min(rate, len(rates) - 1)]["kbps"] for rates in ladders), 3),
            **{key: max(rates[min(rate, len(rates) - 1)][key] for rates in ladders) for key in ("mean", "max")},
        }
        for rate in range(max(map(len, ladders)))
    ]


def _parse_placement(nth: int, values: list[float]) -> Placement:
    try:
        return Placement.parse(values)
    except ValueError as error:
        raise invalid_field_problem(("places", nth), str(error)) from None
