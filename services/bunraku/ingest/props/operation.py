"""Operations on the props of the library: files become models, which sessions bring on their stages."""

from __future__ import annotations

import hashlib
from pathlib import Path, PurePath
from typing import Any, NamedTuple

from bunraku.http.timestamp import format_timestamp
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.job_queue import UploadJob
from bunraku.ingest.persistence import quota_problem
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import require_result
from bunraku.ingest.source_file import clean_filename
from bunraku.ingest.upload import UploadRules
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.props.placing import Grip
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.storage.motion_id import derive_job_id, derive_motion_id
from bunraku.storage.record import QuotaExceeded, StoredProp

MAX_FILE_BYTES = 16 << 20
"""Size of a file of which a prop is made."""
MAX_SECONDS = 60.0
"""Time limit for making a model."""


class PropOutcome(NamedTuple):
    """A stored prop, and whether this operation created it."""

    prop: StoredProp
    is_new: bool


class PropFit(NamedTuple):
    """How a prop is wanted: its length in metres, and where it is held; None: as in the file."""

    length: float | None = None
    grip: Grip | None = None


def create_prop_job(digest: bytes, filename: str, subject: str, fit: PropFit) -> UploadJob:
    """Describe the job for a file with this SHA-256 digest. It is not queued: the client waits for its end."""
    prop_id = derive_motion_id(hashlib.sha256(digest + f" prop {fit.length} {fit.grip}".encode()).digest())
    details = {"kind": "prop", "prop": prop_id, "filename": clean_filename(filename), "subject": subject}
    return UploadJob(derive_job_id(prop_id, subject), details)


class PropOperation:
    """Making of props."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._context = context
        self._worker_slots = worker_slots
        self.rules = UploadRules(MAX_FILE_BYTES, "reduce its images before the export", self._check_quota)

    async def make(self, fit: PropFit, job: UploadJob, path: Path, progress: UploadProgress) -> PropOutcome:
        """Make the prop of a file and store it, unless it is stored already; raise `ProblemError`."""
        prop_id, filename, subject = (job.details[name] for name in ("prop", "filename", "subject"))
        progress.advance_to("preparing" if self._worker_slots.is_preparing else "waiting")
        if (known := await self._context.catalogue.get_prop(prop_id)) is not None:
            return PropOutcome(known, False)
        async with self._worker_slots.hold(subject):
            progress.advance_to("reading")
            outcome = await self._worker_slots.run_job(JobKind.PROP, (prop_id, path, *fit), MAX_SECONDS)
        result = require_result(outcome, filename=filename)
        name = clean_text(PurePath(filename).stem) or filename
        description = {"name": name, "filename": filename, **result.description}
        prop = StoredProp(prop_id, self._context.clock(), description, subject)
        try:
            is_new = await self._context.catalogue.add_prop(prop, result.packed, self._context.settings.prop_quota())
        except QuotaExceeded as error:
            raise quota_problem(error, "props") from None
        return PropOutcome(prop if is_new else await self._context.catalogue.get_prop(prop_id) or prop, is_new)

    async def _check_quota(self, subject: str) -> None:
        try:
            await self._context.catalogue.check_prop_quota(subject, self._context.settings.prop_quota())
        except QuotaExceeded as error:
            raise quota_problem(error, "props") from None


def prop_json(prop: StoredProp) -> dict[str, Any]:
    """Return a prop as the API describes it."""
    return {"id": prop.id, "created": format_timestamp(prop.created / 1e6, "milliseconds"), **prop.description}
