"""Operation that derives a motion with the performers of further motions."""

from __future__ import annotations

import json
from collections import Counter
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.codec.container import StoredMotion
from bunraku.http.admission import AdmissionLimit
from bunraku.http.problem_details import invalid_field_problem
from bunraku.ingest.derived_motion import Derivation, DerivedMotionFactory
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.labels import combined_tags
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.motion.placement import Placement
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import MAX_NAME_CHARACTERS, clean_text
from bunraku.storage.motion_id import derive_digest
from bunraku.storage.record import CatalogueEntry
from bunraku.wire.limbs import MAX_PERFORMERS

MAX_EDITS = 16
"""Performer edits in progress at the same time; further ones get 503."""
MAX_EDITS_PER_SUBJECT = 4


class PerformersRequest(BaseModel):
    """Motions whose performers join a motion, and the placement of all performers."""

    model_config = ConfigDict(extra="forbid")
    motions: Annotated[
        list[Annotated[str, Field(max_length=64)]],
        Field(min_length=1, max_length=MAX_PERFORMERS - 1, description="motion ids; an id may occur repeatedly"),
    ]
    places: Annotated[
        list[Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]] | None,
        Field(
            min_length=2,
            max_length=MAX_PERFORMERS,
            description="x and z, metres, and turn about y, radians, of every performer, the motion's own first; "
            "default: in a row, facing one way",
        ),
    ] = None


class PerformersOperation:
    """Combination of the performers of several motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._derived_motions = DerivedMotionFactory(context, worker_slots)
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds
        self._limit = AdmissionLimit("performer edits", MAX_EDITS, MAX_EDITS_PER_SUBJECT)

    async def add_performers(self, motion_id: str, request: PerformersRequest, subject: str = "") -> StoreOutcome:
        """Derive a motion with the requested performers, stored by `subject`; raise `ProblemError`."""
        placements = (
            None
            if request.places is None
            else [_parse_placement(index, values) for index, values in enumerate(request.places)]
        )
        others = [await self._derived_motions.require_motion(other) for other in request.motions]

        async def run(new_id: str, stored: StoredMotion) -> JobResult | JobRejection:
            other_motions = [await self._derived_motions.require_object(other) for other in request.motions]
            arguments = (new_id, stored, other_motions, placements)
            return await self._worker_slots.run_job(JobKind.PERFORMERS, arguments, self._timeout_s)

        async def describe(base: CatalogueEntry, result: JobResult) -> dict[str, Any]:
            motion_names = [name for entry in (base, *others) for name in performer_motion_names(entry)]
            return {
                **base.description,
                **result.description,
                "name": combined_name(motion_names),
                "tags": combined_tags((base, *others)),
                "pieces": motion_names,
                "rates": combined_ladder([entry.description["rates"] for entry in (base, *others)]),
            }

        addition = f" performed with {json.dumps([request.motions, request.places])}".encode()
        digest = derive_digest(motion_id, addition)
        with self._limit.admit(subject):
            return await self._derived_motions.find_or_create(Derivation(motion_id, digest, run, describe, subject))


def performer_motion_names(entry: CatalogueEntry) -> list[str]:
    """Return the name of the original motion of each performer."""
    description = entry.description
    names: list[str] | None = description.get("pieces")
    name = clean_text(str(description.get("name") or "")) or "A dance"
    return names or [name] * int(description.get("performers", 1))


def combined_name(motion_names: list[str]) -> str:
    """Return a name for a combination of motions, at most `MAX_NAME_CHARACTERS` characters."""
    counts = Counter(motion_names)
    name = " + ".join(each if count == 1 else f"{each} \u00d7 {count}" for each, count in counts.items())
    return name if len(name) <= MAX_NAME_CHARACTERS else f"{clean_text(name, MAX_NAME_CHARACTERS - 1)}\u2026"


def combined_ladder(ladders: list[list[dict[str, float]]]) -> list[dict[str, float]]:
    """Return the bitrate ladder of combined motions: the sum of bitrates (kbit/s), the largest error (mm).

    It has as many levels as the longest ladder; shorter ladders contribute their highest level to the rest.
    """
    combined = []
    for index in range(max(map(len, ladders))):
        levels = [ladder[min(index, len(ladder) - 1)] for ladder in ladders]
        errors = {key: max(level[key] for level in levels) for key in ("mean", "max")}
        combined.append({"kbps": round(sum(level["kbps"] for level in levels), 3), **errors})
    return combined


def _parse_placement(index: int, values: list[float]) -> Placement:
    try:
        return Placement.parse(values)
    except ValueError as error:
        raise invalid_field_problem(("places", index), str(error)) from None
