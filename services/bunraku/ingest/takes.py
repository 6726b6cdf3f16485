"""Operation that turns each take of an uploaded motion file into a stored motion."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bunraku.ingest.entry import entry_json
from bunraku.ingest.job_process import list_takes
from bunraku.ingest.job_queue import MAX_OBSERVED_JOBS, JobDetails, JobQueue, UploadJob
from bunraku.ingest.motion import MotionOperation, derive_take_id
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import MAX_TEXT_CHARACTERS, NOTHING_MOVES, JobRejection, rejection_problem
from bunraku.ingest.source_file import SourceFile, clean_filename
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_document
from bunraku.runtime.problem import ProblemError
from bunraku.storage.motion_id import derive_job_id, derive_motion_id

MAX_TAKES = 64
"""Takes of one file that are stored."""
MAX_LATER_JOBS = 4
"""Answered jobs of one subject with which a replica leaves the queue: their files take space."""


def create_takes_job(digest: bytes, filename: str, subject: str) -> UploadJob:
    """Describe the job for all takes of a motion file with this SHA-256 digest."""
    details = {
        "kind": "takes",
        "digest": digest.hex(),
        "filename": clean_filename(filename),
        "subject": subject,
    }
    return UploadJob(derive_job_id("takes", subject, digest), details)


@dataclass(slots=True)
class TakesOutcome:
    """Takes of a file: stored ones, the names and problems of those that cannot be stored, and the names of the rest.

    The name is None for takes beyond `MAX_TAKES`.
    """

    stored: list[StoreOutcome] = field(default_factory=list)
    skipped: list[tuple[str | None, ProblemError]] = field(default_factory=list)
    pending: list[str] = field(default_factory=list)

    @property
    def status(self) -> int:
        """HTTP status: 202 if takes are pending, 201 if a motion is new, else 200."""
        return 202 if self.pending else 201 if any(outcome.is_new for outcome in self.stored) else 200

    def to_json(self) -> dict[str, Any]:
        """Return the outcome in the API's JSON."""
        skipped = [
            {"take": take, "title": problem.title, "detail": problem.detail}
            | {name: problem.extra.get(name) for name in ("line", "field", "hint")}
            for take, problem in self.skipped
        ]
        texts: dict[str, Any] = clean_document({"skipped": skipped, "pending": self.pending}, MAX_TEXT_CHARACTERS)
        return {"items": [entry_json(outcome.entry) for outcome in self.stored], **texts}


class TakesOperation:
    """Ingestion of all takes of motion files, one after another."""

    def __init__(
        self,
        context: ServiceContext,
        worker_slots: WorkerSlots,
        motions: MotionOperation,
        answer_s: float | None = None,
    ) -> None:
        """`answer_s` is the time after which `receive` returns, by default that of one upload."""
        self._context = context
        self._worker_slots = worker_slots
        self._motions = motions
        # subjects of the jobs with which the queue goes on
        self._later_jobs: dict[str, str] = {}
        self._timeout_s = context.settings.upload_seconds
        self._answer_s = self._timeout_s if answer_s is None else answer_s

    async def receive(self, queue: JobQueue, job: UploadJob, path: Path, progress: UploadProgress) -> TakesOutcome:
        """Run a job of `create_takes_job`; raise `ProblemError`.

        If several takes need more time than one upload may, return, so that the client is answered: `queue` goes on
        with the job, unless it has `MAX_LATER_JOBS` of the subject.
        """
        outcome = TakesOutcome()
        try:
            async with asyncio.timeout(None) as time_limit, queue.persist_job(job, path):
                await self._store_takes(job.details, path, progress, outcome, time_limit)
        except TimeoutError:
            # a cancelled job stays with the queue
            if not await self._may_finish_later(job):
                await queue.discard_job(job.id)
                hint = "send the file again later: its other takes are then stored"
                problem = ProblemError(503, "Out of time", "the server had no time for it", hint=hint)
                outcome.skipped += [(take, problem) for take in outcome.pending]
                outcome.pending.clear()
                if not outcome.stored:
                    raise _find_main_problem(outcome.skipped) from None
        return outcome

    async def _may_finish_later(self, job: UploadJob) -> bool:
        """Count the job among the unfinished ones of its subject, and return True, if there are few enough."""
        unfinished = await self._context.catalogue.list_job_holds(MAX_OBSERVED_JOBS)
        self._later_jobs = {job_id: subject for job_id, subject in self._later_jobs.items() if job_id in unfinished}
        subject = job.details["subject"]
        others = [job_id for job_id, one in self._later_jobs.items() if one == subject and job_id != job.id]
        if len(others) >= MAX_LATER_JOBS:
            return False
        self._later_jobs[job.id] = subject
        return True

    async def run_job(self, details: JobDetails, path: Path, progress: UploadProgress) -> TakesOutcome:
        """Run a job of `create_takes_job` without a limit on its total time (a `JobHandler`)."""
        outcome = TakesOutcome()
        await self._store_takes(details, path, progress, outcome)
        return outcome

    async def _store_takes(
        self,
        details: JobDetails,
        path: Path,
        progress: UploadProgress,
        outcome: TakesOutcome,
        time_limit: asyncio.Timeout | None = None,
    ) -> None:
        """Store the takes of a file, and keep `outcome` up to date; raise `ProblemError` if none can be stored.

        A problem of the server or of the whole file ends the job; one of a take does not affect the others.
        """
        digest, filename, subject = bytes.fromhex(details["digest"]), details["filename"], details.get("subject", "")
        progress.advance_to("preparing" if self._worker_slots.is_preparing else "waiting")
        async with self._worker_slots.hold(subject):
            progress.advance_to("reading")
            takes = await list_takes(path, MAX_TAKES, self._timeout_s)
        if isinstance(takes, JobRejection):
            raise rejection_problem(takes, filename=filename)
        if not takes.names:
            source = SourceFile(path, filename, subject)
            outcome.stored.append(await self._motions.ingest_file(derive_motion_id(digest), source, progress))
            return
        outcome.pending += takes.names
        if time_limit is not None:
            time_limit.reschedule(asyncio.get_running_loop().time() + self._answer_s)
        for number, name in enumerate(takes.names, 1):
            progress.begin_take(number, len(takes.names))
            source = SourceFile(path, filename, subject, name, is_one_of_several=True)
            try:
                outcome.stored.append(await self._motions.ingest_file(derive_take_id(digest, name), source, progress))
            except ProblemError as problem:
                if problem.status >= 500:
                    raise
                outcome.skipped.append((name, problem))
            outcome.pending.remove(name)
        if not outcome.stored:
            raise _find_main_problem(outcome.skipped)
        if takes.count > MAX_TAKES:
            detail = f"the file has {takes.count:,} takes, of which the first {MAX_TAKES} are read"
            hint = "send the others in files of their own, or one at a time by its name"
            outcome.skipped.append((None, ProblemError(422, "Too many takes", detail, hint=hint)))


def _find_main_problem(skipped: list[tuple[str | None, ProblemError]]) -> ProblemError:
    """Return the problem of the first take that is not just a pose, or else of the first, with the take's name."""
    take, problem = next((pair for pair in skipped if pair[1].title != NOTHING_MOVES), skipped[0])
    problem.extra.setdefault("take", take)
    return problem
