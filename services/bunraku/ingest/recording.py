"""Operation that records a session as a motion, requested on the bus (`ingest.keep`)."""

from __future__ import annotations

import asyncio
import secrets
from typing import Any

import msgpack
import numpy as np
from pydantic import ValidationError

from bunraku.codec.container import StoredMotion
from bunraku.http.admission import AdmissionLimit
from bunraku.http.problem_details import validation_problem
from bunraku.ingest.entry import entry_json
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import NOTHING_TO_KEEP, JobResult, require_result
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.lease import hold_lease
from bunraku.messaging.recording_request import (
    MAX_RECORDING_S,
    RECORDING_FPS,
    RECORDING_KEY_PREFIX,
    RecordingRequest,
)
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.storage.motion_id import derive_motion_id
from bunraku.storage.record import CatalogueEntry

MAX_ACTIVE_RECORDINGS = 8
"""Recordings in progress at the same time; further ones get 503."""
MAX_RECORDINGS_PER_SUBJECT = 2
RECORDING_TIMEOUT_S = 100.0
"""Time limit of a recording, including the wait for a worker slot: the session service waits for 120 s."""
INHERITED_FIELDS = ("profile", "joints", "rest_pose", "unit", "guessed", "fit", "extension", "fingers", "face", "tags")
"""Members of a description that concern the skeleton, and the tags, copied from the played motion."""


class RecordingOperation:
    """Recording of sessions."""

    def __init__(
        self,
        context: ServiceContext,
        worker_slots: WorkerSlots,
        *,
        max_active: int = MAX_ACTIVE_RECORDINGS,
        timeout_s: float = RECORDING_TIMEOUT_S,
    ) -> None:
        self._context = context
        self._worker_slots = worker_slots
        self._limit = AdmissionLimit("recordings", max_active, MAX_RECORDINGS_PER_SUBJECT)
        self._timeout_s = timeout_s

    async def handle_message(self, message: bytes) -> bytes:
        """Respond to a bus request whose data is the name of a stored `RecordingRequest`.

        The response is MessagePack: `{"motion": ...}` as `POST /v1/motions` returns it, or `{"problem": ...}` with the
        values of `ProblemError`.
        """
        try:
            request = await self._context.motion_store.get_log(message.decode("ascii", "replace"))
            if request is None:
                raise ProblemError(404, "No such order", f"the library has no recording request {message[:40]!r}")
            response = {"motion": entry_json(await self.record_session(parse_recording_request(request)))}
        except ProblemError as error:
            response = {"problem": error.to_dict()}
        packed: bytes = msgpack.packb(response)
        return packed

    async def record_session(self, request: RecordingRequest) -> CatalogueEntry:
        """Record an interval of a session as a motion and store it; raise `ProblemError`."""
        with self._limit.admit(request.subject):
            try:
                async with asyncio.timeout(self._timeout_s):
                    return await self._record_session(request)
            except TimeoutError:
                detail = f"the recording was not complete within {self._timeout_s:g} s"
                raise ProblemError(503, "Busy", detail, hint="record a shorter part, or try again") from None

    async def _record_session(self, request: RecordingRequest) -> CatalogueEntry:
        log = await self._context.motion_store.get_log(request.log)
        if log is None:
            raise ProblemError(404, "No such log", f"the library has no log {request.log[:40]!r}", field="log")
        await check_quota(self._context, request.subject)
        motions = await self._load_motions(log)
        motion_id = derive_motion_id(secrets.token_bytes(32))
        lease = hold_lease(self._context.key_values, f"{RECORDING_KEY_PREFIX}.{request.log}")
        async with lease, self._worker_slots.hold(request.subject):
            outcome = await self._worker_slots.run_job(
                JobKind.RECORDING, (motion_id, request, log, motions), self._timeout_s
            )
        result = require_result(outcome)
        description = await self._build_description(request, result, len(log))
        return (await store_motion(self._context, motion_id, result, description, request.subject)).entry

    async def _load_motions(self, log: bytes) -> dict[str, StoredMotion]:
        """Return the motions that a session played, by id, without those that were removed."""

        def read_motion_ids() -> tuple[str, ...]:
            from bunraku.playout.session_log import SessionLog

            return SessionLog.unpack(log).motions

        try:
            motion_ids = await asyncio.to_thread(read_motion_ids)
        except ValueError as error:
            raise ProblemError(422, "Unreadable log", f"the session's log cannot be read: {error}") from None
        motions = [await self._context.motion_store.get(motion_id) for motion_id in motion_ids]
        return {motion.id: motion for motion in motions if motion is not None}

    async def _build_description(self, request: RecordingRequest, result: JobResult, log_bytes: int) -> dict[str, Any]:
        """Return the description of a recording; its skeleton is that of the played motion."""
        motion = await self._context.catalogue.get_motion(result.description["kept_from"])
        known = motion.description if motion is not None else {}
        title = clean_text(known.get("name") or "") or "A dance"
        return {
            "name": clean_text(request.name or "") or f"{title.removesuffix(', kept')}, kept",
            "filename": "",
            "bytes": log_bytes,
            "source": f"kept from a session of {title} ({result.description['kept_from']})",
            **{key: known[key] for key in INHERITED_FIELDS if key in known},
            **result.description,
        }


def parse_recording_request(message: bytes) -> RecordingRequest:
    """Parse a MessagePack request; raise `ProblemError` (422) with the invalid field."""
    try:
        request = RecordingRequest.model_validate(msgpack.unpackb(message))
    except ValidationError as error:
        raise validation_problem(error) from None
    except (ValueError, msgpack.UnpackException) as error:
        raise ProblemError(422, "Invalid request", f"not a recording request: {error}") from None
    if request.frame_count < 1:
        raise ProblemError(422, NOTHING_TO_KEEP, "the interval is shorter than one frame", field="seconds")
    if request.frame_count > MAX_RECORDING_S * RECORDING_FPS:
        detail = f"a recording has at most {MAX_RECORDING_S} seconds"
        raise ProblemError(422, "Too long", detail, field="seconds", hint="record a shorter part")
    try:
        camera = request.camera_keyframes
    except ValueError as error:
        raise ProblemError(422, "Invalid request", f"camera: {error}", field="camera") from None
    if not np.isfinite(camera).all():
        raise ProblemError(422, "Invalid request", "camera: the values must be finite numbers", field="camera")
    if not (np.diff(camera[:, 0]) > 0.0).all():
        raise ProblemError(422, "Invalid request", "camera: the times of keyframes must ascend", field="camera")
    return request
