"""Operation that derives a motion with a camera and lights."""

from __future__ import annotations

from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.http.large_body import BodySource, LargeBodies
from bunraku.ingest.derived_motion import Derivation, DerivedMotionFactory
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.keyframe import digest_staging
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.storage.record import CatalogueEntry


class SceneOperation:
    """Addition of cameras and lights to motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self.bodies = LargeBodies("scene edits")
        """Bodies of requests, in JSON."""
        self._derived_motions = DerivedMotionFactory(context, worker_slots)
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds

    async def add_scene(self, motion_id: str, body: BodySource, subject: str = "") -> StoreOutcome:
        """Derive a motion with the camera and lights of a body, stored by `subject`; raise `ProblemError`."""
        digest = await self.bodies.process(digest_staging, body, motion_id)

        async def run(new_id: str, stored: StoredMotion) -> JobResult | JobRejection:
            return await self._worker_slots.run_job(JobKind.SCENE, (new_id, stored, body), self._timeout_s)

        async def describe(base: CatalogueEntry, result: JobResult) -> dict[str, Any]:
            return {**base.description, **result.description}

        return await self._derived_motions.find_or_create(Derivation(motion_id, digest, run, describe, subject))
