"""Cameras and lights for motions: a motion stays as it is, and a new one is made that is the same with them beside."""

from __future__ import annotations

from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import ProblemError
from bunraku.ingest.derived_motion import DerivedMotionFactory
from bunraku.ingest.keyframe import KeyframeOrderError, Staging, check_keyframe_order
from bunraku.ingest.motion import MAX_ACTIVE_UPLOADS, UploadOperation
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry


class SceneOperation:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: ServiceContext, uploads: UploadOperation) -> None:
        self._derived_motions = DerivedMotionFactory(backing, uploads)
        self._worker_slots = uploads.worker_slots
        self._timeout_s = backing.settings.upload_seconds
        self._active = 0

    async def add_scene(self, motion: str, staging: Staging, subject: str = "") -> tuple[CatalogueEntry, bool]:
        """The motion `motion` with what is asked for, stored by `subject`, and whether it is new; raises
        `ProblemError`."""
        if staging.camera is None and staging.lights is None:
            raise ProblemError(422, "Nothing to add", "neither a camera nor lights are in it", field="camera")
        try:
            check_keyframe_order(staging)
        except KeyframeOrderError as error:
            raise ProblemError(422, "Out of order", str(error), field=error.field) from None
        if self._active >= MAX_ACTIVE_UPLOADS:
            raise ProblemError(
                503, "Busy", f"{MAX_ACTIVE_UPLOADS} stagings are under way", hint="try again in a few seconds"
            )

        async def dress(made: str, stored: StoredMotion) -> JobResult | JobRejection:
            return await self._worker_slots.run_job("dress", (made, stored, staging), self._timeout_s)

        async def described(before: CatalogueEntry, made: JobResult) -> dict[str, Any]:
            return {**before.description, **made.description}

        self._active += 1
        try:
            staged = f" staged {staging.model_dump_json()}".encode()
            return await self._derived_motions.find_or_create(motion, staged, dress, described, subject=subject)
        finally:
            self._active -= 1
