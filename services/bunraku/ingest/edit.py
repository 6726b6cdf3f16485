"""Operation that derives an edited copy of a motion: cut, mirrored, or closed to a loop."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from bunraku.codec.container import StoredMotion
from bunraku.codec.timing import Timing
from bunraku.http.problem_details import invalid_field_problem
from bunraku.ingest.derived_motion import Derivation, DerivedMotionFactory
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.job_queue import JobDetails, UploadJob
from bunraku.ingest.labels import Name
from bunraku.ingest.performers import combined_ladder
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.motion.mirror import opposite_joint
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import MAX_NAME_CHARACTERS, clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.storage.motion_id import derive_digest, derive_job_id
from bunraku.storage.record import CatalogueEntry

MotionTime = Annotated[int, Field(ge=0, lt=1 << 53)]


class EditRequest(BaseModel):
    """Edit of a motion; it has at least one effect."""

    model_config = ConfigDict(extra="forbid")
    start: Annotated[MotionTime, Field(description="begin of the part, motion time in microseconds")] = 0
    end: Annotated[
        MotionTime | None, Field(description="end of the part, microseconds; default: that of the motion")
    ] = None
    mirror: Annotated[bool, Field(strict=True, description="exchange left and right")] = False
    loop: Annotated[
        bool, Field(strict=True, description="blend the end into what precedes the start, for a seamless repetition")
    ] = False
    name: Annotated[Name | None, Field(description="default: the name of the motion and the effects")] = None


class EditPlan(NamedTuple):
    """Effects of an edit on one motion: frames `first` to `end` - 1 of the first performer."""

    first: int
    end: int
    mirror: bool
    loop: bool
    is_cut: bool

    @property
    def effects(self) -> list[str]:
        """Words for the default name of the new motion."""
        return [
            word for word, is_set in (("cut", self.is_cut), ("mirrored", self.mirror), ("loop", self.loop)) if is_set
        ]


def plan_edit(timing: Timing, request: EditRequest) -> EditPlan:
    """Return the plan of an edit, with its times at the nearest frames; raise `ProblemError` (422)."""
    if request.end is not None and request.end > timing.duration_us:
        raise invalid_field_problem(("end",), f"the motion ends at {timing.duration_us} \u00b5s")
    first = round(request.start * timing.fps / 1e6)
    end = timing.frames if request.end is None else min(round(request.end * timing.fps / 1e6), timing.frames)
    if first >= end:
        field = "start" if request.end is None else "end"
        detail = f"the part must have at least one frame, {1e6 / timing.fps:.0f} \u00b5s, between start and end"
        raise invalid_field_problem((field,), detail)
    plan = EditPlan(first, end, request.mirror, request.loop, (first, end) != (0, timing.frames))
    if not plan.effects:
        detail = "the edit changes nothing: give a start or end within the motion, mirror or loop"
        raise ProblemError(422, "Nothing to edit", detail, field="start")
    return plan


def create_edit_job(motion_id: str, request: EditRequest, subject: str) -> UploadJob:
    """Describe the job that edits a motion; the job's file is the request."""
    details = {"kind": "edit", "motion": motion_id, "subject": subject}
    return UploadJob(derive_job_id(motion_id, subject, request.model_dump_json().encode()), details)


class EditOperation:
    """Edited copies of motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._derived_motions = DerivedMotionFactory(context, worker_slots)
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds

    async def check(self, motion_id: str, request: EditRequest) -> None:
        """Raise `ProblemError` if the motion does not exist or the request is not possible, before there is a job."""
        await self._plan(motion_id, request)

    async def run_job(self, details: JobDetails, path: Path, progress: UploadProgress) -> StoreOutcome:
        """Run a job of `create_edit_job` (a `JobHandler`)."""
        request = EditRequest.model_validate_json(await asyncio.to_thread(path.read_bytes))
        return await self.edit(details["motion"], request, details.get("subject", ""), progress)

    async def edit(
        self, motion_id: str, request: EditRequest, subject: str = "", progress: UploadProgress | None = None
    ) -> StoreOutcome:
        """Derive the edited motion, stored by `subject`; raise `ProblemError`."""
        upload_progress = progress or UploadProgress()
        upload_progress.advance_to("preparing" if self._worker_slots.is_preparing else "waiting")
        plan = await self._plan(motion_id, request)

        async def run(new_id: str, stored: StoredMotion) -> JobResult | JobRejection:
            upload_progress.advance_to("reading")
            return await self._worker_slots.run_job(
                JobKind.EDIT,
                (new_id, stored, plan.first, plan.end, plan.mirror, plan.loop),
                self._timeout_s,
                lambda share: upload_progress.advance_to("encoding", share),
            )

        async def describe(base: CatalogueEntry, result: JobResult) -> dict[str, Any]:
            return describe_edit(base.description, result.description, plan, request.name)

        addition = f" edited {json.dumps([plan.first, plan.end, plan.mirror, plan.loop, request.name])}".encode()
        digest = derive_digest(motion_id, addition)
        return await self._derived_motions.find_or_create(Derivation(motion_id, digest, run, describe, subject))

    async def _plan(self, motion_id: str, request: EditRequest) -> EditPlan:
        await self._derived_motions.require_motion(motion_id)
        return plan_edit((await self._derived_motions.require_object(motion_id)).first_track, request)


def describe_edit(base: dict[str, Any], result: dict[str, Any], plan: EditPlan, name: str | None) -> dict[str, Any]:
    """Return the description of an edited motion, from those of its source and of the job's result."""
    description = {**base, **result}
    description["rates"] = combined_ladder(description.pop("ladders"))
    if "audio" in result:
        description["audio"] = {**base.get("audio", {}), **result["audio"]}
    else:
        description.pop("audio", None)
    if plan.mirror and "joints" in base:
        description["joints"] = {opposite_joint(joint): source for joint, source in base["joints"].items()}
    effects = ", ".join(["", *plan.effects])
    title = clean_text(str(base.get("name") or ""), MAX_NAME_CHARACTERS - len(effects)) or "A dance"
    return {**description, "name": name or f"{title}{effects}"}
