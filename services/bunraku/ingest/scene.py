"""Operation that derives a motion with a camera and lights."""

from __future__ import annotations

from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.ingest.admission import AdmissionLimit
from bunraku.ingest.derived_motion import Derivation, DerivedMotionFactory
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.keyframe import KeyframeOrderError, Staging, check_keyframe_order
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import CatalogueEntry


class SceneOperation:
    """Addition of cameras and lights to motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._derived_motions = DerivedMotionFactory(context, worker_slots)
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds
        self._limit = AdmissionLimit("scene edits")

    async def add_scene(self, motion_id: str, staging: Staging, subject: str = "") -> StoreOutcome:
        """Derive a motion with the camera and lights of `staging`, stored by `subject`; raise `ProblemError`."""
        if staging.camera is None and staging.lights is None:
            detail = "the request has neither a camera nor lights; send at least one of them"
            raise ProblemError(422, "Nothing to add", detail, field="camera")
        try:
            check_keyframe_order(staging)
        except KeyframeOrderError as error:
            raise ProblemError(422, "Out of order", str(error), field=error.field) from None

        async def run(new_id: str, stored: StoredMotion) -> JobResult | JobRejection:
            return await self._worker_slots.run_job(JobKind.SCENE, (new_id, stored, staging), self._timeout_s)

        async def describe(base: CatalogueEntry, result: JobResult) -> dict[str, Any]:
            return {**base.description, **result.description}

        key = f" staged {staging.model_dump_json()}".encode()
        with self._limit:
            return await self._derived_motions.find_or_create(Derivation(motion_id, key, run, describe, subject))
